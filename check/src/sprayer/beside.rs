//! In what two runs differ besides their controllers: their scores say little of each other then.

use serde::Serialize;
use serde_json::Value;

use super::run::SprayerRun;

/// Drives that differ by less are one, seconds and metres: a process ends a run at no exact instant.
const ONE_DRIVE: f64 = 0.05;

impl SprayerRun {
    /// What differs between the settings of two runs, each as `key: own, beside other`, and those first that litres hang on most: drive, what went wrong with the machine, scene
    /// with its seed, boom. Nothing where only the controllers differ.
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let mut all = Differences::default();
        let driven = |run: &Self| {
            let time = run.pass.time();
            let (way_m, s) = (run.pass.way_m(time.to), time.length());
            [s, way_m, if s > 0.0 { way_m / s } else { 0.0 }]
        };
        let (own, beside) = (driven(self), driven(other));
        if own.iter().zip(beside).any(|(own, beside)| (own - beside).abs() > ONE_DRIVE) {
            let told = |[s, way_m, mean]: [f64; 3]| format!("{way_m:.2} m in {s:.2} s ({mean:.2} m/s)");
            all.0.push(format!("drive: {}, beside {}", told(own), told(beside)));
        }
        let faults =
            |run: &Self| run.pass.troubles().0.iter().map(|trouble| trouble.fault).collect::<Vec<_>>();
        if faults(self) != faults(other) {
            let told = |run: &Self| match run.pass.troubles().0.len() {
                0 => "none".to_owned(),
                count => format!("{count}"),
            };
            all.0.push(format!("faults of the machine: {}, beside {}", told(self), told(other)));
        }
        all.of("scene", &self.scene, &other.scene);
        all.of("boom", self.pass.boom(), other.pass.boom());
        all.0
    }
}

#[derive(Default)]
struct Differences(Vec<String>);

impl Differences {
    fn of(&mut self, name: &str, own: &impl Serialize, beside: &impl Serialize) {
        // What cannot be written cannot have been kept.
        let value = |of: serde_json::Result<Value>| of.unwrap_or(Value::Null);
        self.values(name, &value(serde_json::to_value(own)), &value(serde_json::to_value(beside)));
    }

    fn values(&mut self, path: &str, own: &Value, beside: &Value) {
        match (own, beside) {
            (own, beside) if own == beside => {}
            (Value::Object(own), Value::Object(beside)) => {
                let keys = own.keys().chain(beside.keys().filter(|key| !own.contains_key(*key)));
                for key in keys {
                    let of =
                        |map: &serde_json::Map<String, Value>| map.get(key).cloned().unwrap_or(Value::Null);
                    self.values(&format!("{path}.{key}"), &of(own), &of(beside));
                }
            }
            (Value::Array(own), Value::Array(beside)) if own.len() == beside.len() => {
                for (place, (own, beside)) in own.iter().zip(beside).enumerate() {
                    self.values(&format!("{path}[{place}]"), own, beside);
                }
            }
            (own, beside) => self.0.push(format!("{path}: {}, beside {}", told(own), told(beside))),
        }
    }
}

fn told(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Array(items) => format!("{} of them", items.len()),
        Value::Object(_) => "another table".to_owned(),
        plain => plain.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn found(own: &Value, beside: &Value) -> Vec<String> {
        let mut all = Differences::default();
        all.of("boom", own, beside);
        all.0
    }

    #[test]
    fn each_key_that_differs_is_named_with_both_values() {
        let own = json!({ "offset_y_m": 2.0, "section": [{ "id": "a" }, { "id": "b" }], "rate": null });
        assert_eq!(found(&own, &own), Vec::<String>::new());
        let beside =
            json!({ "offset_y_m": 2.5, "section": [{ "id": "a" }, { "id": "c" }], "rate": { "at_m_s": 1 } });
        let mut differences = found(&own, &beside);
        differences.sort();
        let wanted = [
            "boom.offset_y_m: 2.0, beside 2.5",
            "boom.rate: none, beside another table",
            "boom.section[1].id: \"b\", beside \"c\"",
        ];
        assert_eq!(differences, wanted);
        let fewer = json!({ "offset_y_m": 2.0, "section": [{ "id": "a" }] });
        assert_eq!(found(&own, &fewer), ["boom.section: 2 of them, beside 1 of them"]);
        let many = |shift: usize| Value::Array((0..20).map(|n| json!(n + shift)).collect());
        assert_eq!(found(&many(0), &many(1)).len(), 20, "none is left out");
    }
}
