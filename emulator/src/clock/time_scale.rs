//! How fast simulated time runs.

use std::str::FromStr;

use rowscan_ports::Delivery;

/// How simulated time runs against the host's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeScale {
    /// So many simulated seconds a host second; deadlines are absolute, a slow client loses scans.
    Paced(f64),
    /// As fast as the clients take it; the simulated clock waits for them and nothing is lost.
    Max,
}

/// Why a time scale was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TimeScaleError {
    /// No scale at all.
    #[error("expected a positive number (1 = real time, 10 = ten times faster) or `max`, found `{0}`")]
    Nonsense(String),
    /// The clock waits for its clients.
    #[error("the clock runs as fast as its clients take what it sends: it has no scale")]
    NotPaced,
}

impl TimeScale {
    /// What happens to data that somebody is too slow for.
    pub fn delivery(self) -> Delivery {
        match self {
            Self::Paced(_) => Delivery::Paced,
            Self::Max => Delivery::Patient,
        }
    }
}

impl FromStr for TimeScale {
    type Err = TimeScaleError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "max" => Ok(Self::Max),
            _ => match text.parse::<f64>() {
                Ok(scale) if scale.is_finite() && (1e-6..=1e6).contains(&scale) => Ok(Self::Paced(scale)),
                _ => Err(TimeScaleError::Nonsense(text.to_owned())),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_scale_is_a_positive_number_or_max() {
        assert_eq!("max".parse(), Ok(TimeScale::Max));
        assert_eq!("0.5".parse(), Ok(TimeScale::Paced(0.5)));
        for nonsense in ["0", "-1", "nan", "inf", "fast", ""] {
            let message = nonsense.parse::<TimeScale>().expect_err(nonsense).to_string();
            assert!(message.contains(&format!("`{nonsense}`")), "{message}");
        }
    }
}
