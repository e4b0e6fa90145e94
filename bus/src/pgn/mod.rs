//! The messages: one table, by theme. A new one is its constant and its line here.

pub mod canopy;
pub mod gnss;
pub mod isobus;
pub mod network;
pub mod sprayer;
pub mod tractor;

use super::message::Message;

/// Every message sent or understood; tests, the DBC file and the documents walk it.
pub const MESSAGES: &[&Message] = &[
    &network::ADDRESS_CLAIMED,
    &network::REQUEST,
    &network::REQUEST_ACKNOWLEDGEMENT,
    &tractor::WHEEL_SPEED,
    &tractor::GROUND_SPEED,
    &tractor::SELECTED_SPEED,
    &tractor::SPEED_COMMAND,
    &tractor::FACILITIES,
    &gnss::POSITION_RAPID,
    &gnss::COURSE_RAPID,
    &gnss::POSITION,
    &canopy::SUMMARY,
    &canopy::IMPACTED_BANDS,
    &canopy::LEAF_BANDS,
    &canopy::LEAF_STATUS,
    &sprayer::NOZZLE_DUTY,
    &sprayer::SECTION_DUTY,
    &sprayer::MORE_SECTION_DUTY,
    &sprayer::SPRAYER_CONTROL,
    &sprayer::SECTION_STATES,
    &sprayer::MORE_SECTION_STATES,
    &sprayer::SPRAYER_STATE,
    &sprayer::FLOW_METER,
    &isobus::PROCESS_DATA,
    &isobus::WORKING_SET_MASTER,
    &isobus::LANGUAGE,
];

/// Where the virtual tractor sits: the address of tractor ECUs.
pub const TRACTOR_ADDRESS: u8 = 0xF0;
/// Where the canopy sensor sits, if nobody else does: the first self-configurable address.
pub const CANOPY_ADDRESS: u8 = 0x80;
/// Where the boom sits, if nobody else does. Canopy sensors count up from theirs.
pub const SPRAYER_ADDRESS: u8 = 0x90;

#[cfg(test)]
mod tests {
    use super::MESSAGES;

    #[test]
    fn a_group_is_one_message() {
        let mut groups: Vec<u32> = MESSAGES.iter().map(|message| message.pgn).collect();
        groups.sort_unstable();
        let twice: Vec<_> = groups.windows(2).filter(|pair| pair[0] == pair[1]).collect();
        assert!(twice.is_empty(), "one parameter group has two meanings: {twice:?}");
    }
}
