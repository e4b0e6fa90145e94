//! The valve bank of a client: what sections are told, and what of that and of its machine is told.

use rowscan_protocol::time::SimTime;

use super::machine::{DeadTimes, Machine, SectionOrder, Seen};
use crate::isobus::ddi::{self, Work};
use crate::isobus::implement::{Implement, element};
use crate::isobus::process_data::refusal;

/// What sections do when their task controller is lost, or section control is switched to manual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnLoss {
    /// All close.
    #[default]
    Close,
    /// They stay as they are.
    Hold,
}

/// What one section is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Valve {
    /// What the task controller wants of it.
    wanted: bool,
    /// What it is told: what is wanted, while the master switch is on. None before a setpoint named it.
    told: Option<bool>,
}

/// The valve bank.
#[derive(Debug)]
pub(super) struct Bank {
    implement: Implement,
    valves: Vec<Valve>,
    /// Master switch, by the setpoint work state.
    is_on: bool,
    /// Sections follow the task controller.
    is_automatic: bool,
    prescription: i32,
    rate: i32,
    /// Signed ground speed of the tractor, m/s, while it is heard.
    pub(super) speed_m_s: Option<f64>,
    /// Height of the canopy, mm, while a sensor tells it.
    pub(super) canopy_mm: Option<i32>,
    /// What does what the valves are told.
    machine: Box<dyn Machine>,
    /// The last look at it.
    seen: Seen,
    orders: Vec<SectionOrder>,
}

/// Why a setpoint commands nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum IdleReason {
    /// It holds a state that is reserved.
    Reserved,
    /// It is of sections, and section control is manual.
    InManual,
    /// It opens sections that do not exist.
    NoSuchSection,
    /// No task controller is connected: none has activated the pool, or its status has not come for too long.
    NotConnected,
    /// Another task controller than the sender is connected.
    OtherSender,
    /// It was refused: bits of [`crate::isobus::process_data::refusal`].
    Refused(u8),
}

impl IdleReason {
    /// How it is acknowledged.
    pub(super) fn refusal(self) -> u8 {
        match self {
            Self::Reserved => refusal::VALUE,
            Self::InManual | Self::NoSuchSection | Self::NotConnected | Self::OtherSender => 0,
            Self::Refused(bits) => bits,
        }
    }
}

impl Bank {
    pub(super) fn new(implement: Implement) -> Self {
        let valves = vec![Valve { wanted: false, told: None }; implement.sections.len()];
        let mut machine = Box::new(DeadTimes::new(implement.clone()));
        Self {
            seen: machine.look(SimTime::ZERO),
            machine,
            implement,
            valves,
            is_on: true,
            is_automatic: false,
            prescription: 1,
            rate: 0,
            speed_m_s: None,
            canopy_mm: None,
            orders: Vec::new(),
        }
    }

    /// Section control is automatic from the start, or waits for the task controller to say so.
    pub(super) fn set_automatic(&mut self, is_automatic: bool) {
        self.is_automatic = is_automatic;
    }

    /// What sections were told since the last call.
    pub(super) fn take_orders(&mut self) -> Vec<SectionOrder> {
        std::mem::take(&mut self.orders)
    }

    /// Another machine does what the valves are told.
    pub(super) fn set_machine(&mut self, machine: Box<dyn Machine>) {
        self.machine = machine;
    }

    /// When its machine is to be looked at.
    pub(super) fn next(&self) -> Option<SimTime> {
        self.machine.next()
    }

    /// Looks at its machine.
    pub(super) fn poll(&mut self, at: SimTime) {
        self.seen = self.machine.look(at);
    }

    /// The task controller is lost, or was told to keep out.
    pub(super) fn lose(&mut self, at: SimTime, policy: OnLoss) {
        if policy == OnLoss::Close {
            self.valves.iter_mut().for_each(|valve| valve.wanted = false);
            self.follow(at);
        }
    }

    /// Sets a value. One with a reserved state is refused; of sections that is only those that have it, the others do what they are told.
    ///
    /// # Errors
    /// Why it commands nothing; the caller has made sure that the element has the DDI and that it can be set.
    pub(super) fn set(
        &mut self,
        at: SimTime,
        ddi: u16,
        value: i32,
        policy: OnLoss,
    ) -> Result<(), IdleReason> {
        if let Some(word) = ddi::word(ddi, ddi::SETPOINT_SECTIONS) {
            let is_reserved = self.asks_for_error(word, value);
            let own = self.in_word(word);
            let opens_missing = ddi::sections(value).into_iter().skip(own).any(|work| work == Work::On);
            self.set_sections(at, word, value);
            return match (is_reserved, self.is_automatic) {
                (true, _) => Err(IdleReason::Reserved),
                (false, false) => Err(IdleReason::InManual),
                (false, true) if opens_missing => Err(IdleReason::NoSuchSection),
                (false, true) => Ok(()),
            };
        }
        let two_states = || match value {
            0..=1 => Ok(value == 1),
            // Error and undefined: two bits have no more.
            2..=3 => Err(IdleReason::Reserved),
            _ => Err(IdleReason::Refused(refusal::VALUE)),
        };
        match ddi {
            ddi::SETPOINT_WORK => {
                self.is_on = two_states()?;
                self.follow(at);
            }
            ddi::SECTION_CONTROL => {
                let was = std::mem::replace(&mut self.is_automatic, two_states()?);
                if was && !self.is_automatic {
                    self.lose(at, policy);
                }
            }
            ddi::PRESCRIPTION_CONTROL => self.prescription = i32::from(two_states()?),
            ddi::SETPOINT_RATE if value < 0 => return Err(IdleReason::Refused(refusal::VALUE)),
            ddi::SETPOINT_RATE => self.rate = value,
            _ => return Err(IdleReason::Refused(refusal::NOT_SETTABLE)),
        }
        Ok(())
    }

    /// True if a word has the state "error" for one of the sections: "absent" leaves one as it is.
    fn asks_for_error(&self, word: u16, value: i32) -> bool {
        ddi::sections(value).into_iter().take(self.in_word(word)).any(|work| work == Work::Error)
    }

    /// Sections of the boom from this word's first one on.
    fn in_word(&self, word: u16) -> usize {
        self.valves.len().saturating_sub(usize::from(word * ddi::SECTIONS))
    }

    /// In manual the task controller's wishes have no effect: what they name stays as it is.
    fn set_sections(&mut self, at: SimTime, word: u16, value: i32) {
        let first = usize::from(word * ddi::SECTIONS);
        for (valve, work) in self.valves.iter_mut().skip(first).zip(ddi::sections(value)) {
            let Some(is_on) = work.is_on() else { continue };
            valve.wanted = if self.is_automatic { is_on } else { valve.wanted };
            // The first that names it is an order, also where it stays shut.
            if valve.told.is_none() {
                valve.told = Some(!(valve.wanted && self.is_on));
            }
        }
        self.follow(at);
    }

    /// Valves are told what is wanted of them.
    fn follow(&mut self, at: SimTime) {
        let Self { implement, valves, is_on, orders, machine, .. } = self;
        for (valve, section) in valves.iter_mut().zip(&implement.sections) {
            let told = valve.wanted && *is_on;
            if valve.told.is_some_and(|before| before != told) {
                valve.told = Some(told);
                let order = SectionOrder { at, number: section.number, is_open: told };
                machine.tell(&order);
                orders.push(order);
            }
        }
    }

    /// Litres per hectare now: at standstill without end while anything is open.
    fn rate_l_ha(&self) -> Option<f64> {
        let flow = self.seen.flow_l_min;
        if flow == 0.0 {
            return Some(0.0);
        }
        // Without a width nothing is known of an area.
        let width_m = Some(f64::from(self.implement.width_mm) / 1000.0).filter(|width_m| *width_m > 0.0);
        let m2_s = self.speed_m_s?.abs() * width_m?;
        Some(flow / 60.0 / m2_s * 10_000.0)
    }

    /// The value of a DDI of an element, as of the last look at the machine; none where it is not known.
    pub(super) fn value(&self, of: u16, ddi: u16) -> Option<i32> {
        let any = self.seen.open.contains(&true);
        let words = |first| ddi::word(ddi, first).filter(|word| *word < self.implement.words());
        let condensed = |word: u16, states: &mut dyn Iterator<Item = bool>| {
            ddi::condensed(states.skip(usize::from(word * ddi::SECTIONS)).map(Work::of))
        };
        Some(match (of, ddi) {
            (element::DEVICE | element::BOOM, ddi::ACTUAL_WORK) => Work::of(any).bits() as i32,
            (element::DEVICE, ddi::CANOPY_HEIGHT) => self.canopy_mm?,
            (element::BOOM, ddi::ACTUAL_WIDTH) => self.implement.width_mm,
            (element::BOOM, ddi::SETPOINT_WORK) => Work::of(self.is_on).bits() as i32,
            (element::BOOM, ddi::SECTION_CONTROL) => i32::from(self.is_automatic),
            (element::BOOM, ddi::TURN_ON_TIME) => self.implement.on_ms,
            (element::BOOM, ddi::TURN_OFF_TIME) => self.implement.off_ms,
            (element::BOOM, _) => match (words(ddi::ACTUAL_SECTIONS), words(ddi::SETPOINT_SECTIONS)) {
                (Some(word), _) => condensed(word, &mut self.seen.open.iter().copied()),
                (_, Some(word)) => condensed(word, &mut self.valves.iter().map(|valve| valve.wanted)),
                _ => return None,
            },
            (element::TANK, ddi::SETPOINT_RATE) => self.rate,
            (element::TANK, ddi::ACTUAL_RATE) => ddi::rate(self.rate_l_ha()?),
            (element::TANK, ddi::PRESCRIPTION_CONTROL) => self.prescription,
            (element::TANK, ddi::TANK) => self.seen.tank_ml?,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isobus::implement::tests::implement;
    use crate::isobus::process_data::refusal;

    const MS: u64 = 1_000_000;

    /// Of so many sections, with section control on.
    fn automatic(sections: u16) -> Bank {
        let mut bank = Bank::new(implement(sections));
        bank.set_automatic(true);
        bank
    }

    fn set(bank: &mut Bank, ms: u64, ddi: u16, value: i32) {
        bank.set(SimTime(ms * MS), ddi, value, OnLoss::Close).expect("it can be set");
    }

    #[test]
    fn sections_do_what_they_are_told_after_their_dead_times() {
        let mut bank = automatic(4);
        set(&mut bank, 100, 290, 0xFFFF_FF11_u32 as i32);
        let told: Vec<_> =
            bank.take_orders().into_iter().map(|order| (order.number, order.is_open)).collect();
        assert_eq!(told, [(1, true), (2, false), (3, true), (4, false)]);
        let actual = |bank: &Bank| bank.value(2, 161).map(|value| value as u32);
        assert_eq!(actual(&bank), Some(0xFFFF_FF00));
        assert_eq!(bank.next(), Some(SimTime(115 * MS)));
        bank.poll(SimTime(115 * MS));
        assert_eq!((actual(&bank), bank.next()), (Some(0xFFFF_FF11), None));
        // Section 3 stays as it is, section 1 closes.
        set(&mut bank, 200, 290, 0xFFFF_FFFC_u32 as i32);
        assert_eq!(bank.next(), Some(SimTime(210 * MS)));
        bank.poll(SimTime(210 * MS));
        assert_eq!(actual(&bank), Some(0xFFFF_FF10));
        assert_eq!(bank.value(2, 290).map(|value| value as u32), Some(0xFFFF_FF10));
        // A pulse of 5 ms never comes.
        set(&mut bank, 300, 290, 0xFFFF_FFFD_u32 as i32);
        set(&mut bank, 305, 290, 0xFFFF_FFFC_u32 as i32);
        assert_eq!(bank.next(), None);
    }

    #[test]
    fn the_master_switch_closes_all_and_gives_them_back() {
        let mut bank = automatic(2);
        set(&mut bank, 0, 290, 5);
        set(&mut bank, 10, 289, 0);
        for reserved in [2, 3] {
            let refused = bank.set(SimTime(20 * MS), 289, reserved, OnLoss::Close);
            assert_eq!(refused, Err(IdleReason::Reserved), "no command: it stays off");
        }
        set(&mut bank, 30, 289, 1);
        let told: Vec<_> = bank.take_orders().iter().map(|order| (order.at.0 / MS, order.is_open)).collect();
        assert_eq!(told, [(0, true), (0, true), (10, false), (10, false), (30, true), (30, true)]);
    }

    #[test]
    fn manual_and_loss_close_or_hold() {
        for (policy, left) in [(OnLoss::Close, 0), (OnLoss::Hold, 5)] {
            let mut bank = automatic(2);
            set(&mut bank, 0, 290, 5);
            bank.poll(SimTime(100 * MS));
            bank.set(SimTime(100 * MS), 160, 0, policy).expect("settable");
            bank.poll(SimTime(200 * MS));
            let open = bank.value(2, 161).map(|value| value & 0xF);
            assert_eq!(open, Some(left), "{policy:?}");
            // In manual it does not follow.
            assert_eq!(bank.set(SimTime(300 * MS), 290, 0, policy), Err(IdleReason::InManual));
            bank.poll(SimTime(400 * MS));
            assert_eq!(bank.value(2, 161).map(|value| value & 0xF), Some(left));
        }
    }

    /// It starts in manual: sections that are told to open were told something, and stay shut until section control is set.
    #[test]
    fn before_section_control_is_set_sections_are_told_to_stay_shut() {
        let mut bank = Bank::new(implement(2));
        let orders = |bank: &mut Bank| -> Vec<_> {
            bank.take_orders().iter().map(|order| (order.number, order.is_open)).collect()
        };
        assert_eq!(bank.value(2, ddi::SECTION_CONTROL), Some(0));
        assert_eq!(bank.set(SimTime::ZERO, 290, 5, OnLoss::Close), Err(IdleReason::InManual));
        assert_eq!(orders(&mut bank), [(1, false), (2, false)]);
        set(&mut bank, 10, 160, 1);
        assert_eq!(orders(&mut bank), [], "what was wanted in manual is forgotten");
        set(&mut bank, 20, 290, 0b1101);
        assert_eq!(orders(&mut bank), [(1, true)], "the other is left as it is");
        // Shut from the start: an order, once.
        let mut shut = automatic(2);
        set(&mut shut, 0, 290, 0);
        set(&mut shut, 10, 290, 0);
        assert_eq!(orders(&mut shut), [(1, false), (2, false)]);
    }

    #[test]
    fn rate_and_tank_follow_from_flow_and_speed() {
        let mut bank = automatic(2);
        let rate = |bank: &Bank| bank.value(3, 2);
        assert_eq!(rate(&bank), Some(0), "nothing flows");
        set(&mut bank, 0, 290, 5);
        bank.poll(SimTime(15 * MS));
        assert_eq!(rate(&bank), None, "the speed is not known");
        bank.speed_m_s = Some(-1.5);
        // 4 l/min on 4 m at 1.5 m/s: 111.11 l/ha.
        assert_eq!(rate(&bank), Some(1_111_111));
        bank.speed_m_s = Some(0.0);
        assert_eq!(rate(&bank), Some(i32::MAX));
        // A minute of 4 l/min, of 400 l.
        bank.poll(SimTime(60_015 * MS));
        assert_eq!(bank.value(3, 72), Some(396_000));
    }

    /// Whatever stood before: a reserved state changes nothing of what it is about, is refused, and is noted once.
    #[test]
    fn a_reserved_state_is_no_command_and_is_noted() {
        let told =
            |bank: &Bank| [290, 289, 160, 158].map(|ddi| bank.value(if ddi == 158 { 3 } else { 2 }, ddi));
        for before in [0, 5] {
            for (ddi, value) in
                [(289, 2), (289, 3), (160, 2), (160, 3), (158, 2), (158, 3), (290, 2), (290, 8), (290, 10)]
            {
                let mut bank = automatic(2);
                set(&mut bank, 0, 290, before);
                let was = told(&bank);
                let at = SimTime(10 * MS);
                // Sections that are not meant are left as they are.
                let value = if ddi == 290 {
                    value | if value & 2 == 0 { 3 } else { 0 } | if value & 8 == 0 { 12 } else { 0 }
                } else {
                    value
                };
                assert_eq!(
                    bank.set(at, ddi, value, OnLoss::Close),
                    Err(IdleReason::Reserved),
                    "{ddi} = {value}"
                );
                assert_eq!(told(&bank), was, "{ddi} = {value}");
            }
        }
        // Others in the same word do what they are told, and places of sections that it lacks say nothing.
        let mut bank = automatic(2);
        assert_eq!(bank.set(SimTime::ZERO, 290, 0b0110, OnLoss::Close), Err(IdleReason::Reserved));
        assert_eq!(bank.value(2, 290).map(|value| value & 0xF), Some(0b0100));
        set(&mut bank, 0, 290, 0xAAAA_AAAF_u32 as i32);
    }

    #[test]
    fn values_that_are_none_are_refused() {
        let mut bank = automatic(2);
        let mut refused =
            |ddi, value| bank.set(SimTime::ZERO, ddi, value, OnLoss::Close).expect_err("refused");
        assert_eq!(refused(ddi::SECTION_CONTROL, 2), IdleReason::Reserved);
        assert_eq!(refused(ddi::SETPOINT_WORK, 4), IdleReason::Refused(refusal::VALUE));
        assert_eq!(refused(ddi::SETPOINT_RATE, -1), IdleReason::Refused(refusal::VALUE));
        assert_eq!(refused(ddi::ACTUAL_WIDTH, 1), IdleReason::Refused(refusal::NOT_SETTABLE));
        assert_eq!(bank.value(0, ddi::CANOPY_HEIGHT), None, "no sensor has told it");
        assert_eq!(bank.value(2, 162), None, "two sections need one word");
    }
}
