//! Settings that a replay refuses because the recorded scans would have to be others, and to whom.

/// Entries kept; the last one counts for all that come after.
const MOST: usize = 64;

/// A setting that was refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RefusedSetting {
    /// Who wanted it: an address, without the port, as clients come again.
    pub client: String,
    /// The telegram's name.
    pub setting: String,
    /// How often.
    pub times: u64,
}

/// All of them, in the order they came.
#[derive(Debug, Default)]
pub(crate) struct RefusedSettings(Vec<RefusedSetting>);

impl RefusedSettings {
    /// Notes one; true if it is the first of its kind.
    pub(crate) fn note(&mut self, peer: &str, setting: &str) -> bool {
        let client =
            peer.parse::<std::net::SocketAddr>().map_or(peer.to_owned(), |peer| peer.ip().to_string());
        let known = self.0.iter().position(|refused| refused.client == client && refused.setting == setting);
        let index = known.or((self.0.len() >= MOST).then_some(MOST - 1));
        match index.and_then(|index| self.0.get_mut(index)) {
            Some(refused) => {
                refused.times += 1;
                false
            }
            None => {
                self.0.push(RefusedSetting { client, setting: setting.to_owned(), times: 1 });
                true
            }
        }
    }

    pub(crate) fn list(&self) -> Vec<RefusedSetting> {
        self.0.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_client_that_comes_again_is_the_same_and_the_list_is_bounded() {
        let mut refused = RefusedSettings::default();
        assert!(refused.note("10.0.0.1:5000", "LMPoutputRange"));
        assert!(!refused.note("10.0.0.1:5001", "LMPoutputRange"));
        assert!(refused.note("10.0.0.2:5000", "LMPoutputRange"));
        assert!(refused.note("a serial line", "LMPoutputRange"));
        (0..1000).for_each(|number| {
            refused.note(&format!("client {number}"), "LMDscandatacfg");
        });
        let list = refused.list();
        assert_eq!((list.len(), list[0].times), (MOST, 2));
        assert_eq!(list.iter().map(|refused| refused.times).sum::<u64>(), 1004);
    }
}
