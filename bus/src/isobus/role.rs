//! What of ISOBUS the rig itself has on a bus.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rowscan_protocol::time::SimTime;

use super::client::{IdleReason, IdleSetpoint, SectionOrder, TaskClient};
use super::server::{News, TaskServer, Untold, What, Wishes};
use super::trouble::TroubleDesk;
use crate::control_function::ControlFunction;
use crate::frame::CanFrame;

/// What sections were told, in the order of time, and what was set and commanded nothing. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct SectionLog(Arc<Mutex<Setpoints>>);

#[derive(Debug, Default)]
struct Setpoints {
    orders: Vec<SectionOrder>,
    /// Setpoints that commanded nothing, by DDI, element and why: the first one, and how many there were.
    idle: BTreeMap<(u16, u16, IdleReason), (SimTime, u64)>,
    /// When the client gave a connection up.
    given_up: Vec<SimTime>,
}

/// Kinds of setpoints without effect that are kept.
const MOST_IDLE: usize = 64;

/// Setpoints of one kind that commanded nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IdleSetpoints {
    /// The first of them.
    pub first: IdleSetpoint,
    /// How many there were.
    pub count: u64,
}

impl SectionLog {
    /// All orders so far.
    pub fn orders(&self) -> Vec<SectionOrder> {
        self.lock().orders.clone()
    }

    /// Setpoints so far that commanded nothing, by DDI, element and why.
    pub fn idle(&self) -> Vec<IdleSetpoints> {
        let of = |(&(ddi, element, why), &(at, count)): (&_, &_)| IdleSetpoints {
            first: IdleSetpoint { at, element, ddi, why },
            count,
        };
        self.lock().idle.iter().map(of).collect()
    }

    /// When the client gave a connection up so far: what it told before holds no more.
    pub fn given_up(&self) -> Vec<SimTime> {
        self.lock().given_up.clone()
    }

    /// After anything that `client` did.
    fn extend(&self, client: &mut TaskClient) {
        let (orders, idle, given_up) = (client.take_orders(), client.take_idle(), client.take_given_up());
        let mut setpoints = self.lock();
        setpoints.orders.extend(orders);
        let room = MOST_IDLE.saturating_sub(setpoints.given_up.len());
        setpoints.given_up.extend(given_up.into_iter().take(room));
        for IdleSetpoint { at, element, ddi, why } in idle {
            let kind = (ddi, element, why);
            if setpoints.idle.len() < MOST_IDLE || setpoints.idle.contains_key(&kind) {
                setpoints.idle.entry(kind).or_insert((at, 0)).1 += 1;
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Setpoints> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What happened to clients of the rig's task controller, but for the values that they told, and what became of its task.
/// Clones share it; the first few news are kept.
#[derive(Clone, Debug, Default)]
pub struct ClientLog(Arc<Mutex<Served>>);

#[derive(Debug, Default)]
struct Served {
    news: Vec<News>,
    steps: Vec<StepTold>,
}

/// A step of a task that was due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepTold {
    /// When.
    pub at: SimTime,
    /// Why no client was told, then or until the next step; none where one was.
    pub untold: Option<Untold>,
}

/// The most news that are kept.
const MOST_NEWS: usize = 256;

impl ClientLog {
    /// All so far.
    pub fn news(&self) -> Vec<News> {
        self.lock().news.clone()
    }

    /// When a client was lost so far: what it told before holds no more.
    pub fn lost(&self) -> Vec<SimTime> {
        let news = self.news().into_iter();
        news.filter(|news| news.what == What::Lost).map(|news| news.at).collect()
    }

    /// All steps that were due so far, in the order of time.
    pub fn steps(&self) -> Vec<StepTold> {
        self.lock().steps.clone()
    }

    /// A step is due, and was told to clients or not.
    fn step(&self, step: StepTold) {
        self.lock().steps.push(step);
    }

    /// After anything that `server` did.
    fn extend(&self, server: &mut TaskServer) {
        let mut kept = self.lock();
        let room = MOST_NEWS.saturating_sub(kept.news.len());
        let news = server.take_news().into_iter().filter(|news| !matches!(news.what, What::Told(_)));
        kept.news.extend(news.take(room));
        // A client that comes, or comes back, before the next step is told this one.
        if let Some(last) = kept.steps.last_mut().filter(|_| server.untold().is_none()) {
            last.untold = None;
        }
    }

    fn lock(&self) -> MutexGuard<'_, Served> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A control function of the rig that speaks ISOBUS.
#[derive(Debug)]
pub enum Role {
    /// The sprayer, a client of somebody's task controller.
    Client {
        /// It.
        client: Box<TaskClient>,
        /// Where goes what its sections are told.
        log: SectionLog,
        /// What is wrong with it.
        troubles: TroubleDesk,
    },
    /// A task controller, for somebody's client.
    Server {
        /// It.
        server: Box<TaskServer>,
        /// What it wants, and from when on.
        task: VecDeque<(SimTime, Wishes)>,
        /// Where goes what happens to its clients.
        log: ClientLog,
        /// What is wrong with it.
        troubles: TroubleDesk,
    },
}

impl ControlFunction for Role {
    fn open(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        match self {
            Self::Client { client, .. } => client.open_settled(at, out),
            Self::Server { server, .. } => server.open_settled(at, out),
        }
    }

    fn next(&self) -> Option<SimTime> {
        match self {
            Self::Client { client, .. } => client.next(),
            Self::Server { server, task, .. } => {
                let due = task.front().map(|(due, _)| *due);
                server.next().into_iter().chain(due).min()
            }
        }
    }

    fn poll(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        match self {
            Self::Client { client, log, troubles } => {
                client.set_trouble(troubles.now());
                client.poll(at, out);
                log.extend(client);
            }
            Self::Server { server, task, log, troubles } => {
                server.set_trouble(troubles.now());
                server.poll(at, out);
                while task.front().is_some_and(|(due, _)| *due <= at) {
                    let Some((due, wishes)) = task.pop_front() else { break };
                    server.command(at, wishes, out);
                    log.step(StepTold { at: due, untold: server.untold() });
                }
                log.extend(server);
            }
        }
    }

    fn handle(&mut self, at: SimTime, frame: &CanFrame, out: &mut Vec<CanFrame>) {
        match self {
            Self::Client { client, log, troubles } => {
                client.set_trouble(troubles.now());
                client.handle(at, frame, out);
                log.extend(client);
            }
            Self::Server { server, log, troubles, .. } => {
                server.set_trouble(troubles.now());
                server.handle(at, frame, out);
                log.extend(server);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rowscan_settings::fault_table::task_controller::TaskControllerFault;

    use super::*;
    use crate::isobus::client::OnLoss;
    use crate::isobus::implement::tests::implement;

    const S: u64 = 1_000_000_000;

    /// Frames of each of the two reach the other one, until both are silent.
    fn carry(at: SimTime, (server, client): (&mut Role, &mut Role), mut said: [Vec<CanFrame>; 2]) {
        while said.iter().any(|said| !said.is_empty()) {
            let [of_server, of_client] = std::mem::take(&mut said);
            let [by_server, by_client] = &mut said;
            of_client.iter().for_each(|frame| server.handle(at, frame, by_server));
            of_server.iter().for_each(|frame| client.handle(at, frame, by_client));
        }
    }

    /// What becomes of steps at 12, 30 and 90 s, with a fault of the client or of the task controller from 15 s on until another second.
    fn steps(fault: TaskControllerFault, (of_client, until_s): (bool, u64)) -> Vec<Option<Untold>> {
        let (log, own, theirs) = (ClientLog::default(), TroubleDesk::default(), TroubleDesk::default());
        let wishes = |open| Wishes { rate_l_ha: None, sections: vec![open] };
        let task = [(12, true), (30, false), (90, true)].map(|(s, open)| (SimTime(s * S), wishes(open)));
        let server = Box::new(TaskServer::new(Wishes::default()));
        let mut server = Role::Server { server, task: task.into(), log: log.clone(), troubles: own.clone() };
        let client = Box::new(TaskClient::new(implement(2), OnLoss::Close));
        let mut client = Role::Client { client, log: SectionLog::default(), troubles: theirs.clone() };
        let mut said = [Vec::new(), Vec::new()];
        server.open(SimTime::ZERO, &mut said[0]);
        client.open(SimTime::ZERO, &mut said[1]);
        carry(SimTime::ZERO, (&mut server, &mut client), said);
        let (desk, from, until) =
            (if of_client { &theirs } else { &own }, SimTime(15 * S), SimTime(until_s * S));
        let mut at = SimTime::ZERO;
        while let Some(next) = server.next().into_iter().chain(client.next()).min() {
            let next = next.max(at);
            if next > SimTime(100 * S) {
                break;
            }
            if at < from && next >= from {
                desk.begin(1, fault);
            }
            if at < until && next >= until {
                desk.end(1);
            }
            at = next;
            let mut said = [Vec::new(), Vec::new()];
            server.poll(at, &mut said[0]);
            client.poll(at, &mut said[1]);
            carry(at, (&mut server, &mut client), said);
        }
        let steps = log.steps();
        assert_eq!(steps.iter().map(|step| step.at.0 / S).collect::<Vec<_>>(), [12, 30, 90]);
        steps.into_iter().map(|step| step.untold).collect()
    }

    #[test]
    fn a_step_is_told_while_a_client_is_there_and_why_not_where_none_is() {
        use TaskControllerFault::{Busy, Lost, Silent};
        const FOR_GOOD: u64 = 1000;
        for (why, fault, of_client, untold) in [
            ("silent", Silent, true, Untold::NoClient),
            ("gone", Lost, true, Untold::NoClient),
            ("not heard", Silent, false, Untold::NoClient),
            ("busy", Busy, false, Untold::Busy),
            ("lost", Lost, false, Untold::Unheard),
        ] {
            let untold = Some(untold);
            assert_eq!(steps(fault, (of_client, FOR_GOOD)), [None, untold, untold], "{why}");
        }
        // A client that answers has all of them, and so has one that is back before the next step.
        assert_eq!(steps(Silent, (true, 16)), [None, None, None], "it answers");
        assert_eq!(steps(Lost, (true, 40)), [None, None, None], "it is back");
    }
}
