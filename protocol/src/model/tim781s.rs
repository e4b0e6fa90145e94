//! SICK TiM781S, the safety variant: as TiM781, with a password of its own.

use super::family::TIM;
use super::{MAINTENANCE, Model, Password};

pub(super) static TIM781S: Model = Model {
    name: "tim781s",
    title: "TiM781S",
    ident_name: "TiM781S",
    type_code: "TiM781S-2174104",
    order_number: "1096363",
    logins: &[MAINTENANCE, Password { level: 3, hash: 0x6FD6_2C05 }],
    ..TIM
};
