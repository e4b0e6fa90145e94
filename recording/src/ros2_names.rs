//! Names as ROS 2 takes them in topics: letters, digits and single underscores, none beginning with a digit
//! (<https://design.ros2.org/articles/topic_and_service_names.html>).

/// What stands before a digit.
const BEFORE_DIGIT: &str = "s";

/// The stream's name in its topics: `192.168.0.1:2112` is `s192_168_0_1_2112`. Where another stream has it already, a number follows.
pub(crate) fn of_stream(name: &str, is_free: impl Fn(&str) -> bool) -> String {
    let tokens: Vec<String> = name.split('/').filter_map(token).collect();
    let plain = if tokens.is_empty() { "stream".to_owned() } else { tokens.join("/") };
    if is_free(&plain) {
        return plain;
    }
    let numbered = (2_u32..).map(|number| format!("{plain}_{number}"));
    numbered.into_iter().find(|name| is_free(name)).unwrap_or(plain)
}

/// The name of a scan's topic or frame in a layer, 1/100° as the telegram has it: `scan`, `scan_layer_250`, `scan_layer_minus_250`.
pub(crate) fn of_layer(name: &str, layer_centideg: i16) -> String {
    match layer_centideg {
        0 => name.to_owned(),
        1.. => format!("{name}_layer_{layer_centideg}"),
        _ => format!("{name}_layer_minus_{}", layer_centideg.unsigned_abs()),
    }
}

/// What stands between two slashes; none if nothing is left of it.
fn token(text: &str) -> Option<String> {
    let words: Vec<&str> =
        text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let token = words.join("_");
    match token.chars().next()? {
        '0'..='9' => Some(format!("{BEFORE_DIGIT}{token}")),
        _ => Some(token),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_name_becomes_one_that_ros_2_takes() {
        for (name, expected) in [
            ("lms111", "lms111"),
            ("192.168.0.1:2112", "s192_168_0_1_2112"),
            ("192.168.0.1:2112/1.2", "s192_168_0_1_2112/s1_2"),
            ("tcp://[::1]:2112", "tcp/s1_2112"),
            ("left__row-", "left_row"),
            ("/öä/", "stream"),
        ] {
            assert_eq!(of_stream(name, |_| true), expected, "{name}");
        }
    }

    #[test]
    fn two_streams_never_share_a_topic() {
        let taken = ["a_b", "a_b_2"];
        assert_eq!(of_stream("a.b", |name| !taken.contains(&name)), "a_b_3");
    }
}
