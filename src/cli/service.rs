//! What a service manager is told: `READY=1` once clients find everything (`sd_notify(3)`; systemd's `Type=notify`).

/// Tells the service manager, if one started this process and asked for it by `NOTIFY_SOCKET`, that every endpoint listens.
pub(super) fn ready() {
    #[cfg(target_os = "linux")]
    if let Err(cause) = sd_notify::notify(&[sd_notify::NotifyState::Ready]) {
        tracing::warn!(%cause, "the service manager behind NOTIFY_SOCKET cannot be told READY=1");
    }
}
