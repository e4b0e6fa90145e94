//! Well-known binary (OGC 06-103r4): a rectangle as a polygon of one closed ring.

/// Little-endian, X longitude, Y latitude.
pub(super) fn polygon(corners: &[[f64; 2]; 4]) -> Vec<u8> {
    const LITTLE_ENDIAN: u8 = 1;
    const POLYGON: u32 = 3;
    let mut bytes = vec![LITTLE_ENDIAN];
    for word in [POLYGON, 1, corners.len() as u32 + 1] {
        bytes.extend_from_slice(&word.to_le_bytes());
    }
    for number in corners.iter().chain(corners.first()).flatten() {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    bytes
}
