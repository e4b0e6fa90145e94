//! The device as REST sees it: the same variables and effects as CoLa's, without telegrams and sessions.

use alloc::vec::Vec;

use super::access::Access;
use super::change::change;
use super::condition::Activity;
use super::context::Context;
use super::state::Device;
use super::variable::{VARIABLES, Value, Variable};
use crate::frame::Dialect;
use crate::telegram::{DateTime, SopasError};
use crate::time::SimTime;

/// What a method does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// `mStartMeasure`, as `LMCstartmeas`.
    Start,
    /// `mStopMeasure`, as `LMCstopmeas`.
    Stop,
    /// `mStandby`, as `LMCstandby`.
    Standby,
    /// `WriteEeprom`, as `mEEwriteall`.
    Save,
    /// `SoftReset`, as `mSCreboot`: what was not saved is lost.
    Restart,
    /// `RebootDevice`: all is saved first.
    SaveAndRestart,
    /// `LoadFactoryDefaults`.
    Deliver,
    /// `LSPsetdatetime`.
    SetDateTime(DateTime),
}

impl Device {
    /// Its variables; none of a model without Compact output.
    pub fn variables(&self) -> impl Iterator<Item = &'static Variable> + use<> {
        let compact = self.model.compact;
        VARIABLES.iter().filter(move |variable| compact.is_some_and(|compact| compact.has(variable.name)))
    }

    /// The one called `name`.
    pub fn variable(&self, name: &str) -> Option<&'static Variable> {
        self.variables().find(|variable| variable.name == name)
    }

    /// The value of one of them, part by part, as somebody reads it who is not logged in.
    ///
    /// # Errors
    /// The device refuses, with CoLa's code.
    pub fn value(&mut self, variable: &Variable, now: SimTime) -> Result<Vec<Value>, SopasError> {
        let mut access = Access::new(Dialect::A);
        variable.value(&Context { device: self, access: &mut access, now })
    }

    /// Sets one of them, as an authorised client does.
    ///
    /// # Errors
    /// The device refuses, with CoLa's code; then nothing has changed.
    pub fn set_value(
        &mut self,
        variable: &Variable,
        value: Vec<Value>,
        now: SimTime,
    ) -> Result<(), SopasError> {
        let mut access = Access::new(Dialect::A);
        let mut context = Context { device: self, access: &mut access, now };
        change(&mut context, |context| variable.set(context, value))
    }

    /// Does what a method asks; false where that cannot be.
    pub fn act(&mut self, action: Action, now: SimTime) -> bool {
        match action {
            Action::Start => self.start_measurement(now),
            Action::Stop => self.stop_measurement(Activity::Stopped),
            Action::Standby => self.stop_measurement(Activity::Standby),
            Action::Save => self.save(),
            Action::Restart => self.reboot(now),
            Action::SaveAndRestart => {
                self.save();
                self.reboot(now);
            }
            Action::Deliver => self.settings = self.as_delivered(),
            Action::SetDateTime(date_time) => return self.clock.set_date_time(now, &date_time),
        }
        true
    }
}
