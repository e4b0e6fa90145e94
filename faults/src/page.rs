//! The page of documentation, written from the table.

use std::fmt::Write;

use crate::event::Direction;
use crate::fault::Fault;
use crate::kinds::{FAULTS, NOT_HERE};

const INTRODUCTION: &str = "\
# Faults

Written by `rowscan faults --markdown`; a test holds that it is up to date.

A file of faults goes to `rowscan proxy --faults FILE`, between a real scanner and its client, to `rowscan emulate --faults FILE` and to `rowscan replay --faults FILE`. It is strict TOML: an \
unknown key is refused with its line and the nearest valid one.

```toml
[[fault]]
id = \"out\"
name = \"stall\"
at = { scan = 500 }
for = { s = 8 }

[[fault]]
name = \"flip\"
region = \"payload\"
at = { after = \"out.end\", plus_s = 2 }
every = { scans = 100 }
count = 5
```

While no fault is active every byte passes untouched. All faults end with the program, by a reset, and by a removal; what they hold back then goes at once. \
Connections that were cut stay cut.

At a recording's end `replay` waits until what they hold back has left. Where nothing has left for 2 s (10 s at `--time-scale max`, where simulated time goes on meanwhile), or after a minute, the rest is lost, and counts as dropped: scans sent and dropped are those that were played. At its end `emulate` waits two seconds for what faults hold back and for the telegrams in its clients' queues, and counts the rest as dropped. Copies (`duplicate`) and damaged telegrams (`truncate`, `flip`, `checksum`) are not counted. What `drop`, `half_open`, `fin` and `rst` take from a client counts as sent, by `emulate` and `replay`: the device has sent it, as a real one would have. Of how many scans that is so, their end says: `scans_kept_by_faults`, a part of `scans_sent`. Scans that `fin` and `rst` find in the queues of the system or of the scanner are not among them.

## Keys that every fault has

| key | value | default |
|---|---|---|
| `name` | the fault | must be given |
| `id` | how events and `after` name it | the name; `flip-2` for a second one |
| `on` | the one stream or part it acts on: `scanner0`, `scanner1` of `emulate`, the recorded stream of `replay`, the name before the source of `proxy` (`left=tcp://…`, else `scanner0`); `tractor`, `encoder`, `gnss`, `can0` | every one that takes it |
| `direction` | `to_client`, `to_device`, `both` | see the table |
| `at` | one of `{ s }` seconds of simulated time; of a proxy, since its start, `{ scan }` the scan telegram of this number on a connection, from 1, \
`{ command = \"sWN LMDscandatacfg\" }` a client's request by kind and name, by name alone, or of an LMS2xx by its first bytes in hex digits, \
`{ after = \"ID\" }` or `{ after = \"ID.end\", plus_s }` the first begin or end of another fault, `{ row_m }`, `{ tree }` the tractor's place (only where there is one) | at once |
| `for` | `{ s }`, or `{ scans }` scan telegrams of the stream | a fault of telegrams: one telegram; else until healed |
| `until` | as `at`; instead of `for` | |
| `every` | `{ s }` or `{ scans }` from one beginning to the next | once |
| `p` | probability of each telegram, piece, connection or datagram; of faults that have none, of each beginning | 1 |
| `count` | at most so many telegrams or connections; of other faults, beginnings | 1 telegram, unless `for`, `until`, `p` or `every` is given |

`scan` counts on one connection: after a reconnect it begins at 1 again. A fault that a scan began acts on that scan's connection only. A fault of telegrams begins with the next \
telegram, never inside one. What looks like an unfinished telegram is let go as it is when nothing follows for 500 ms.

Random choices are keyed by seed, fault, stream and number of the event: the same seed and the same telegrams give the same bytes. Faults that `s` or `row_m` begins \
depend on what passes at that time; `scan` does not.

At most 64 KiB wait each way behind a fault; then whoever writes must wait, as for a full socket. At `--time-scale max` there is no bound, because time itself would wait. There, time stands still while nobody takes scans. It goes on while a fault holds bytes back that leave with time, so a client is answered even if the fault began before it connected.

In lockstep, what `delay`, `jitter`, `stall` or `bandwidth` holds back is no part of a step: it leaves when its time has come, and the step does not wait for it.

## Parts

Faults of the byte path act wherever bytes pass. The others act on a part of an emulated rig, at an instant of simulated time: a *device* or *clock* fault on a scanner (by the name of \
its stream), a *vehicle* fault on `tractor`, `encoder` or `gnss`, a *bus* fault on `can0` (all ports of `--can` are one bus), a *sprayer* fault on `sprayer` of a scenario that has one, a *datagrams* fault on `gnss` or `can0` where they send UDP. A part that is not there refuses them, with the reason; so \
do `replay` and `proxy`, because a recording and a real device have no such part. The truth of where the tractor is stands in the events (`row_m`): `stop`, `reverse`, \
`speed_command`, `lateral` and `bounce` move scanners, encoder and antenna with it; `encoder` and `gnss` change only what is reported. Time itself goes on evenly, whatever a clock says. \
A fault of a part that `row_m` or `tree` begins does so within 10 ms.

What CAN controllers would tell goes out where a port carries it: as Linux error frames to `candump:FILE` and `socketcan:`, as status flags of `slcan:`; elsewhere there is silence.

## Events

`{\"event\":\"fault\"}` with `what` (`begin`, `act`, `skipped`, `end`, `healed`), `id`, `name`, `on`, `at_s`, and as far as known `row_m`, `connection` (from 1), `direction`, `offset` \
(before faults, in that connection and direction), `scan`, `acts`, `reason`. Of telegrams lost in a row each is an act. `skipped` says that the fault could not act on this telegram, such as a checksum in CoLa A.

A recording beside faults holds what went over the client's wire: after faults what the client got, before faults what it sent.

## The table

";

/// docs/faults.md.
pub fn markdown() -> String {
    let mut page = INTRODUCTION.to_owned();
    page += "| fault | acts on | direction | does | a driver must report | recovery expected |\n|---|---|---|---|---|---|\n";
    for fault in FAULTS.iter() {
        let ways = directions(fault);
        let (layer, Fault { name, about, reports, recovery, .. }) = (fault.layer.name(), fault);
        let _ = writeln!(page, "| `{name}` | {layer} | {ways} | {about} | {reports} | {recovery} |");
    }
    page += "\nOn serial wires (`--pty`, `--serial`, `--rfc2217`) there are no connections: ";
    let wireless: Vec<String> =
        FAULTS.iter().filter(|fault| !fault.on_wires).map(|fault| format!("`{}`", fault.name)).collect();
    let _ = write!(page, "{} are refused there.\n\n## Parameters\n\n", wireless.join(", "));
    page += "| fault | key | value | default | |\n|---|---|---|---|---|\n";
    for fault in FAULTS.iter() {
        for parameter in fault.parameters {
            let (form, key) = (parameter.form.words(), parameter.key);
            let _ = writeln!(
                page,
                "| `{}` | `{key}` | {form} | {} | {} |",
                fault.name, parameter.default, parameter.about
            );
        }
    }
    page += "\n## Not here\n\nThese rows of the fault table are not built; a file that asks for one is refused with the reason.\n\n| fault | why |\n|---|---|\n";
    for (names, why) in NOT_HERE {
        let names: Vec<String> = names.split(" / ").map(|name| format!("`{name}`")).collect();
        let _ = writeln!(page, "| {} | {why} |", names.join(", "));
    }
    page += "\nOf the rows that are there, `drop`, `duplicate` and `reorder` leave telegram counters as the device wrote them (`counters = \"patched\"` is not there). `accept_silent` and `half_open` cannot keep the system from completing the TCP handshake, as a pulled cable would.\n";
    page
}

fn directions(fault: &Fault) -> &'static str {
    match fault.directions {
        [] => "–",
        [Direction::ToClient] => "to_client",
        [Direction::ToDevice] => "to_device",
        _ => "both",
    }
}
