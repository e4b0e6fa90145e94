//! Fingerprints of settings, and seeds that follow from them. FNV-1a, 64 bits: to tell files apart, not to keep secrets.

const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

/// FNV-1a over bytes.
pub fn of_bytes(bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes.into_iter().fold(OFFSET, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME))
}

/// Sixteen hexadecimal digits that tell one value from another by its JSON.
pub fn of(value: &dyn erased_serde::Serialize) -> String {
    of_content(&serde_json::to_vec(value).unwrap_or_default())
}

/// The same of a file, by its bytes.
pub fn of_content(bytes: &[u8]) -> String {
    format!("{:016x}", of_bytes(bytes.iter().copied()))
}

/// The seed of one unit: a hash of the study's name, the study's seed, and the unit's number. Below 2^53, so that a reader whose numbers
/// are floating point repeats it.
pub fn seed(study: &str, seed: u64, index: usize) -> u64 {
    let key = study.bytes().chain(seed.to_le_bytes()).chain((index as u64).to_le_bytes());
    of_bytes(key) >> 11
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_fnv_1a() {
        // Published test vectors of the algorithm.
        assert_eq!(of_bytes([]), 0xcbf2_9ce4_8422_2325);
        assert_eq!(of_bytes(*b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(of_bytes(*b"foobar"), 0x85944171f73967e8);
    }

    #[test]
    fn seeds_differ_by_study_seed_and_unit() {
        let all = [seed("areas", 1, 0), seed("areas", 1, 1), seed("areas", 2, 0), seed("resolution", 1, 0)];
        for (i, a) in all.iter().enumerate() {
            assert!(all.iter().skip(i + 1).all(|b| a != b));
            assert!(*a < 1 << 53);
        }
    }
}
