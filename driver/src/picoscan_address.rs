//! Where a scanner with REST and Compact output is: `picoscan://HOST:PORT?udp=2115`.

use std::fmt;
use std::net::Ipv4Addr;

use rowscan_protocol::challenge::{PASSWORD, USER};

/// The port of REST when none is given.
pub(crate) const REST_PORT: u16 = 80;
/// The port that datagrams come to when none is given: as delivered.
const UDP_PORT: u16 = 2115;

/// A scanner that is set up over REST and sends its scans as datagrams.
#[derive(Clone, PartialEq, Eq)]
pub struct PicoscanAddress {
    /// Host and port of its REST interface.
    pub address: String,
    /// The port of this machine that its datagrams shall come to; 0 takes a free one.
    pub udp: u16,
    /// The address of this machine that they shall come to; the one that the scanner is reached from where absent.
    pub bind: Option<Ipv4Addr>,
    /// Have it send the readings of its inertial measurement unit there, too.
    pub imu: bool,
    /// And those of its encoder.
    pub encoder: bool,
    /// Who logs in.
    pub user: String,
    /// With which password. It is never shown.
    pub password: String,
}

impl PicoscanAddress {
    /// This REST interface, all else as delivered.
    pub fn new(address: String) -> Self {
        Self {
            address,
            udp: UDP_PORT,
            bind: None,
            imu: false,
            encoder: false,
            user: USER.into(),
            password: PASSWORD.into(),
        }
    }

    /// With what stands behind the `?`: `udp`, `bind`, `imu`, `encoder`, `user` and `password`, joined by `&`.
    pub(crate) fn with_query(mut self, query: &str) -> Result<Self, String> {
        for part in query.split('&').filter(|part| !part.is_empty()) {
            let (key, value) = part.split_once('=').unwrap_or((part, ""));
            let set = match key {
                "udp" => value.parse().map(|port| self.udp = port).map_err(|_| "a port from 0 to 65535"),
                "bind" => value
                    .parse()
                    .map(|address| self.bind = Some(address))
                    .map_err(|_| "an IPv4 address of this machine"),
                "imu" => switch(value).map(|on| self.imu = on),
                "encoder" => switch(value).map(|on| self.encoder = on),
                "user" if !value.is_empty() => {
                    value.clone_into(&mut self.user);
                    Ok(())
                }
                "password" if !value.is_empty() => {
                    value.clone_into(&mut self.password);
                    Ok(())
                }
                "user" | "password" => Err("a text"),
                _ => return Err(format!("`{key}` is not one of udp, bind, imu, encoder, user, password")),
            };
            set.map_err(|expected| format!("`{key}` is {expected}, found `{value}`"))?;
        }
        Ok(self)
    }
}

fn switch(value: &str) -> Result<bool, &'static str> {
    match value {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("`on` or `off`"),
    }
}

/// The text without what stands behind `password=`.
pub(crate) fn without_password(text: &str) -> String {
    let hidden = |part: &str| match part.split_once("password=") {
        Some((before, _)) => format!("{before}password=***"),
        None => part.to_owned(),
    };
    text.split('&').map(hidden).collect::<Vec<_>>().join("&")
}

impl fmt::Display for PicoscanAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "picoscan://{}?udp={}", self.address, self.udp)?;
        if let Some(bind) = self.bind {
            write!(f, "&bind={bind}")?;
        }
        let switches = [("imu", self.imu), ("encoder", self.encoder)];
        switches.iter().filter(|(_, on)| *on).try_for_each(|(key, _)| write!(f, "&{key}=on"))?;
        if self.user != USER {
            write!(f, "&user={}", self.user)?;
        }
        if self.password != PASSWORD {
            f.write_str("&password=***")?;
        }
        Ok(())
    }
}

impl fmt::Debug for PicoscanAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}
