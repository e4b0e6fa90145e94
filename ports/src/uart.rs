//! What a receiver hears that listens at another rate than the sender sends at: what it would on copper.

/// Rates this close understand each other: a receiver samples each bit in its middle, and the tenth must still be met.
const TOLERANCE: f64 = 0.03;

/// True if a receiver at `to` understands a sender at `from`, bits a second.
pub fn understands(from: u32, to: u32) -> bool {
    let (from, to) = (f64::from(from), f64::from(to));
    // False for a rate of 0 as well.
    (from / to - 1.0).abs() <= TOLERANCE
}

/// The bytes a receiver at `to` bits a second makes of `bytes` sent back to back at `from`: start bit, eight bits from the lowest on, stop bit.
///
/// A receiver waits for the line to fall, then samples the middle of each of its own bits. Where the stop bit should be and is not, it
/// has a framing error, which a serial port hands on as a zero byte.
pub fn hear(bytes: &[u8], from: u32, to: u32) -> Vec<u8> {
    if understands(from, to) {
        return bytes.to_vec();
    }
    if from == 0 || to == 0 {
        // B0: the port is hung up.
        return Vec::new();
    }
    // In bits of the sender.
    let bit = f64::from(from) / f64::from(to);
    let end = 10.0 * bytes.len() as f64;
    let is_high = |at: f64| -> bool {
        let (byte, bit) = ((at / 10.0) as usize, (at % 10.0) as u32);
        match (bytes.get(byte), bit) {
            (None, _) | (_, 9..) => true,
            (_, 0) => false,
            (Some(byte), bit) => byte >> (bit - 1) & 1 == 1,
        }
    };
    let mut heard = Vec::new();
    let mut at = 0.0;
    loop {
        // The next moment the line is low; it changes at whole bits of the sender only.
        while at < end && is_high(at) {
            at = at.floor() + 1.0;
        }
        if at >= end {
            return heard;
        }
        let sample = |n: u32| is_high(at + (f64::from(n) + 0.5) * bit);
        if sample(0) {
            // Too short for a start bit.
            at = at.floor() + 1.0;
            continue;
        }
        let byte = (0..8).fold(0, |byte, n| byte | u8::from(sample(n + 1)) << n);
        heard.push(if sample(9) { byte } else { 0 });
        at += 9.5 * bit;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASK: [u8; 7] = [0x02, 0x00, 0x01, 0x00, 0x31, 0x15, 0x12];

    #[test]
    fn equal_rates_understand_each_other() {
        assert_eq!(hear(&ASK, 9600, 9600), ASK);
        assert_eq!(hear(&ASK, 38_400, 38_461), ASK);
    }

    #[test]
    fn a_port_that_is_hung_up_neither_sends_nor_hears() {
        assert!(hear(&ASK, 0, 38_400).is_empty() && hear(&ASK, 38_400, 0).is_empty());
        assert!(hear(&ASK, 0, 0).is_empty() && !understands(0, 0));
    }

    #[test]
    fn other_rates_hear_garbage() {
        for rate in [9600, 19_200, 38_400, 500_000] {
            for other in [9600, 19_200, 38_400, 500_000] {
                if rate != other {
                    let heard = hear(&ASK, rate, other);
                    assert_ne!(heard, ASK, "{rate} heard at {other}");
                    assert!(heard.len() <= ASK.len() * (other / rate).max(1) as usize, "{rate} at {other}");
                }
            }
        }
        assert!(hear(&ASK, 500_000, 9600).len() <= 1, "seven bytes are over before one is heard");
        assert!(hear(&ASK, 9600, 500_000).len() > 7, "each long low is heard as many");
    }
}
