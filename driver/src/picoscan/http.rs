//! As much of HTTP/1.1 as a scanner's REST needs: one request a connection, answers of known length, in chunks, or up to the end.

/// Bytes that an answer may have.
pub(super) const MAX_ANSWER: usize = 60 * 1024;

/// An answer of HTTP.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Answer {
    pub(super) code: u16,
    pub(super) body: Vec<u8>,
}

/// A request for `/api/NAME`: a GET, or a POST of `body`.
pub(super) fn request(host: &str, name: &str, body: Option<&str>) -> Vec<u8> {
    let verb = if body.is_some() { "POST" } else { "GET" };
    let mut text = format!(
        "{verb} /api/{name} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nAccept: application/json\r\n"
    );
    if let Some(body) = body {
        text += &format!("Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}", body.len());
    } else {
        text += "\r\n";
    }
    text.into_bytes()
}

/// True if `bytes` are an answer whose end has come, as far as it says so itself.
pub(super) fn is_whole(bytes: &[u8]) -> bool {
    let Some((head, body)) = split(bytes) else { return false };
    header(head, "content-length")
        .and_then(|length| length.parse::<usize>().ok())
        .is_some_and(|length| body.len() >= length)
}

/// The answer that `bytes` are, up to where the connection ended; none if they are none.
pub(super) fn answer(bytes: &[u8]) -> Option<Answer> {
    let (head, body) = split(bytes)?;
    let mut words = head.split_ascii_whitespace();
    words.next().filter(|version| version.starts_with("HTTP/1."))?;
    let code = words.next()?.parse().ok()?;
    let in_chunks = header(head, "transfer-encoding").is_some_and(|how| how.eq_ignore_ascii_case("chunked"));
    let body = match header(head, "content-length").map(|length| length.parse::<usize>()) {
        _ if in_chunks => joined(body)?,
        Some(length) => body.get(..length.ok()?)?.to_vec(),
        None => body.to_vec(),
    };
    Some(Answer { code, body })
}

/// Head and body.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let end = bytes.windows(4).position(|four| four == b"\r\n\r\n")?;
    Some((std::str::from_utf8(bytes.get(..end)?).ok()?, bytes.get(end + 4..)?))
}

fn header<'a>(head: &'a str, name: &str) -> Option<&'a str> {
    let mut lines = head.lines().skip(1).filter_map(|line| line.split_once(':'));
    lines.find(|(key, _)| key.eq_ignore_ascii_case(name)).map(|(_, value)| value.trim())
}

/// The bytes that chunks hold; none where one is cut off.
fn joined(mut body: &[u8]) -> Option<Vec<u8>> {
    let mut whole = Vec::new();
    loop {
        let end = body.windows(2).position(|two| two == b"\r\n")?;
        let size = std::str::from_utf8(body.get(..end)?).ok()?.split(';').next()?.trim();
        let size = usize::from_str_radix(size, 16).ok().filter(|size| *size <= MAX_ANSWER)?;
        if size == 0 {
            return Some(whole);
        }
        whole.extend_from_slice(body.get(end + 2..)?.get(..size)?);
        body = body.get(end + 2 + size..)?.strip_prefix(b"\r\n")?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_end_where_they_say_so() {
        let told = b"HTTP/1.1 401 Unauthorized\r\ncontent-length: 2\r\n\r\n{}rest";
        assert!(is_whole(told) && !is_whole(&told[..told.len() - 5]));
        assert_eq!(answer(told), Some(Answer { code: 401, body: b"{}".to_vec() }));
        assert_eq!(answer(&told[..told.len() - 5]), None, "cut off");
        let chunks =
            b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n3\r\n{\"a\r\n4;x\r\n\":1}\r\n0\r\n\r\n";
        assert_eq!(answer(chunks), Some(Answer { code: 200, body: b"{\"a\":1}".to_vec() }));
        assert_eq!(answer(&chunks[..chunks.len() - 12]), None, "a chunk is cut off");
        let open = b"HTTP/1.0 200 OK\r\n\r\n[1]";
        assert!(!is_whole(open));
        assert_eq!(answer(open), Some(Answer { code: 200, body: b"[1]".to_vec() }));
        for nonsense in
            [&b""[..], b"HTTP/1.1 200 OK", b"SSH-2.0\r\n\r\n", b"HTTP/1.1 two\r\n\r\n", b"\xFF\r\n\r\n"]
        {
            assert_eq!(answer(nonsense), None, "{nonsense:?}");
        }
    }
}
