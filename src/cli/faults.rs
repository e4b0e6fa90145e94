//! `rowscan faults`

use rowscan_faults::{FAULTS, Fault, NOT_HERE, markdown};
use serde::Serialize;

use super::output::{self, print};
use super::page_args::PageArgs;
use super::{Failure, Format, Outcome};

/// One fault, as it is listed.
#[derive(Debug, Serialize)]
struct Row {
    name: &'static str,
    acts_on: &'static str,
    parameters: String,
    does: &'static str,
}

impl From<&'static Fault> for Row {
    fn from(fault: &'static Fault) -> Self {
        let keys: Vec<&str> = fault.parameters.iter().map(|parameter| parameter.key).collect();
        Self { name: fault.name, acts_on: fault.layer.name(), parameters: keys.join(", "), does: fault.about }
    }
}

pub(super) fn run(args: PageArgs) -> Result<Outcome, Failure> {
    if args.markdown {
        print(&markdown())?;
        return Ok(Outcome::Done);
    }
    let rows: Vec<Row> = FAULTS.iter().map(Row::from).collect();
    output::print_rows(args.format, &rows)?;
    if args.format == Format::Table {
        let names: Vec<&str> = NOT_HERE.iter().map(|(names, _)| *names).collect();
        print(&format!("not here: {}; `rowscan faults --markdown` says why\n", names.join(", ")))?;
    }
    Ok(Outcome::Done)
}
