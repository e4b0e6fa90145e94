//! Things that may have a name before them: `left=tcp://192.168.0.1:2112`.

use std::str::FromStr;

/// Something on the command line with the name of the stream it is for, if it has one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Named<T> {
    pub(super) name: Option<String>,
    pub(super) it: T,
}

impl<T: FromStr> FromStr for Named<T> {
    type Err = T::Err;

    fn from_str(text: &str) -> Result<Self, T::Err> {
        // Streams may be called by their address, with `/2` or `/1.2` behind it; paths and what stands behind a `?` are no names.
        let is_word = |name: &str| {
            !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_.:[]".contains(&b))
        };
        let is_number = |text: &str| text.bytes().all(|b| b.is_ascii_digit() || b == b'.');
        let is_name = |name: &str| match name.split_once('/') {
            Some((address, number)) => is_word(address) && address.contains(':') && is_number(number),
            None => is_word(name),
        };
        Ok(match text.split_once('=') {
            Some((name, it)) if is_name(name) => Self { name: Some(name.to_owned()), it: it.parse()? },
            _ => Self { name: None, it: text.parse()? },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_stands_before_the_first_equals_sign_and_is_no_path() {
        for (text, name, it) in [
            ("left=127.0.0.1:2111", Some("left"), "127.0.0.1:2111"),
            ("192.168.0.1:2112=127.0.0.1:0", Some("192.168.0.1:2112"), "127.0.0.1:0"),
            ("127.0.0.1:2111", None, "127.0.0.1:2111"),
            ("serial:/dev/ttyUSB0?baud=38400", None, "serial:/dev/ttyUSB0?baud=38400"),
            ("192.168.0.1:2112/1.2=127.0.0.1:0", Some("192.168.0.1:2112/1.2"), "127.0.0.1:0"),
            ("./a=b", None, "./a=b"),
            ("a:b/c=d", None, "a:b/c=d"),
        ] {
            let expected = Named { name: name.map(str::to_owned), it: it.to_owned() };
            assert_eq!(text.parse(), Ok(expected), "{text}");
        }
    }
}
