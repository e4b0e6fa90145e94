//! Login, settings that are kept, restart, dialect, calendar.

use crate::device::context::{Callable, Context, Readable, Writable};
use crate::device::refusal::Fault;
use crate::device::state::Device;
use crate::frame::Dialect;
use crate::model::Password;
use crate::telegram::SopasError;
use crate::telegram::ee_writeall::WriteAll;
use crate::telegram::eihst_cola::HostDialect;
use crate::telegram::lsp_datetime::{CurrentDateTime, SetDateTime};
use crate::telegram::run::Run;
use crate::telegram::sc_reboot::Reboot;
use crate::telegram::set_access_mode::SetAccessMode;

impl Callable for SetAccessMode {
    /// A wrong password is answered with 0, not with an error.
    fn call(self, context: &mut Context<'_>) -> Result<bool, SopasError> {
        context.access.delay = context.device.takes(context.device.model.times.login_reply);
        let login = Password { level: self.level, hash: self.password.0 };
        let Device { model, more_logins, .. } = &*context.device;
        if !model.logins.contains(&login) && !more_logins.contains(&login) {
            return Ok(false);
        }
        context.access.level = login.level;
        context.device.condition.held_by_login |= context.device.options.strict_login;
        Ok(true)
    }
}

impl Callable for Run {
    fn call(self, context: &mut Context<'_>) -> Result<bool, SopasError> {
        context.access.level = 1;
        context.device.release();
        Ok(true)
    }
}

impl Callable for WriteAll {
    fn call(self, context: &mut Context<'_>) -> Result<bool, SopasError> {
        context.access.delay = context.device.takes(context.device.times().save_reply);
        context.device.save();
        Ok(true)
    }
}

impl Callable for Reboot {
    fn call(self, context: &mut Context<'_>) -> Result<(), SopasError> {
        context.device.reboot(context.now);
        context.access.closing = true;
        Ok(())
    }
}

impl Readable for HostDialect {
    fn get(context: &Context<'_>) -> Self {
        context.device.host_dialect.unwrap_or(context.access.dialect).into()
    }
}

impl Writable for HostDialect {
    /// This answer still goes out in the old dialect; the session switches after it.
    fn set(self, context: &mut Context<'_>) -> Result<(), SopasError> {
        let dialect: Dialect = self.dialect().ok_or(Fault::NoSuchCode)?;
        context.device.host_dialect = Some(dialect);
        context.access.next_dialect = Some(dialect);
        Ok(())
    }
}

impl Readable for CurrentDateTime {
    fn get(context: &Context<'_>) -> Self {
        Self { now: context.device.date_time(context.now) }
    }
}

impl Callable for SetDateTime {
    fn call(self, context: &mut Context<'_>) -> Result<bool, SopasError> {
        match context.device.clock.set_date_time(context.now, &self.now) {
            true => Ok(true),
            false => Err(Fault::NoDate.into()),
        }
    }
}
