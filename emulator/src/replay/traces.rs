//! What a recorded scanner's answers tell of its model, where nobody asked for its name.

use rowscan_protocol::model::Model;
use rowscan_protocol::telegram::lfe_rec::FieldResults;
use rowscan_protocol::telegram::{Kind, Telegram, Variable, field_nnn};

/// What the models differ in and telegrams show.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Traces {
    /// Evaluation fields that were read: one more than the highest slot.
    slots: u16,
    /// Results in one LFErec: fewest and most.
    results: Option<(usize, usize)>,
}

impl Traces {
    /// Takes the next telegram of the device.
    pub(super) fn take(&mut self, telegram: &Telegram<'_>) {
        let Telegram { kind, name, args } = telegram;
        if !matches!(kind, Kind::Ra | Kind::Sn) {
            return;
        }
        if let Some(slot) = field_nnn::slot(name) {
            self.slots = self.slots.max(slot.saturating_add(1));
        }
        if *name == FieldResults::NAME
            && let Ok(FieldResults { fields }) = args.decode()
        {
            let (fewest, most) = self.results.unwrap_or((fields.len(), fields.len()));
            self.results = Some((fewest.min(fields.len()), most.max(fields.len())));
        }
    }

    /// Whether this model can have answered so.
    pub(super) fn fit(self, model: &Model) -> bool {
        let results = self.results.is_none_or(|(fewest, most)| {
            fewest >= usize::from(model.evaluations.always) && most <= usize::from(model.evaluations.most)
        });
        self.slots <= model.fields && results
    }
}
