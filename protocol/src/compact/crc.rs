//! The checksum of Compact telegrams.

/// CRC-32 as zlib has it: polynomial EDB88320, reflected, inverted at start and end.
///
/// ```
/// assert_eq!(rowscan_protocol::compact::crc32(b"123456789"), 0xCBF4_3926);
/// ```
pub fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        let index = (crc ^ u32::from(byte)) & 0xFF;
        // Always in the table: the index has eight bits.
        (crc >> 8) ^ TABLE.get(index as usize).copied().unwrap_or_default()
    })
}

const TABLE: [u32; 256] = {
    let mut table = [0; 256];
    let mut index = 0;
    while index < table.len() {
        let mut crc = index as u32;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 0 { crc >> 1 } else { (crc >> 1) ^ 0xEDB8_8320 };
            bit += 1;
        }
        table[index] = crc;
        index += 1;
    }
    table
};
