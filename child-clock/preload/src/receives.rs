//! Calls that receive from a socket with a receive time-out.

use libc::{c_int, c_void, msghdr, pollfd, size_t, sockaddr, socklen_t, ssize_t};

use crate::descriptors::{forget, receive_ns, set_receive_ns};
use crate::errno;
use crate::instant::after;
use crate::page::page;
use crate::polls::wait_until;
use crate::real::real;

/// Receives by `take` once there is something, as long as the socket's time-out allows. Without one, and of a socket that does not block, at once.
fn received(socket: c_int, flags: c_int, take: impl Fn(c_int) -> ssize_t) -> ssize_t {
    let timed = page().zip(receive_ns(socket)).filter(|_| flags & libc::MSG_DONTWAIT == 0 && blocks(socket));
    let Some((page, ns)) = timed else { return take(flags) };
    let deadline = after(page, ns);
    loop {
        let mut asked = [pollfd { fd: socket, events: libc::POLLIN, revents: 0 }];
        match wait_until(page, &mut asked, deadline, std::ptr::null()) {
            None => return take(flags),
            Some(0) => {
                errno::set(libc::EAGAIN);
                return -1;
            }
            Some(1..) => {}
            Some(_) => return -1,
        }
        let taken = take(flags | libc::MSG_DONTWAIT);
        // Another thread may have taken what was there.
        if taken >= 0 || errno::get() != libc::EAGAIN {
            return taken;
        }
    }
}

fn blocks(socket: c_int) -> bool {
    // SAFETY: no memory is handed over.
    let flags = unsafe { libc::fcntl(socket, libc::F_GETFL) };
    flags >= 0 && flags & libc::O_NONBLOCK == 0
}

#[unsafe(no_mangle)]
unsafe extern "C" fn recv(socket: c_int, buffer: *mut c_void, size: size_t, flags: c_int) -> ssize_t {
    received(
        socket,
        flags,
        |flags| real!(recv(socket => c_int, buffer => *mut c_void, size => size_t, flags => c_int) -> ssize_t),
    )
}

#[unsafe(no_mangle)]
unsafe extern "C" fn read(file: c_int, buffer: *mut c_void, size: size_t) -> ssize_t {
    if receive_ns(file).is_none() {
        return real!(read(file => c_int, buffer => *mut c_void, size => size_t) -> ssize_t);
    }
    // It is a socket: of others no time-out is known.
    // SAFETY: the caller's.
    unsafe { recv(file, buffer, size, 0) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn recvfrom(
    socket: c_int,
    buffer: *mut c_void,
    size: size_t,
    flags: c_int,
    from: *mut sockaddr,
    from_size: *mut socklen_t,
) -> ssize_t {
    received(socket, flags, |flags| {
        real!(recvfrom(
            socket => c_int,
            buffer => *mut c_void,
            size => size_t,
            flags => c_int,
            from => *mut sockaddr,
            from_size => *mut socklen_t,
        ) -> ssize_t)
    })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn recvmsg(socket: c_int, message: *mut msghdr, flags: c_int) -> ssize_t {
    received(
        socket,
        flags,
        |flags| real!(recvmsg(socket => c_int, message => *mut msghdr, flags => c_int) -> ssize_t),
    )
}

#[unsafe(no_mangle)]
unsafe extern "C" fn readv(file: c_int, parts: *const libc::iovec, count: c_int) -> ssize_t {
    let whole = || real!(readv(file => c_int, parts => *const libc::iovec, count => c_int) -> ssize_t);
    let Ok(length) = usize::try_from(count) else { return whole() };
    if receive_ns(file).is_none() {
        return whole();
    }
    // SAFETY: all of it may be zero.
    let mut message: msghdr = unsafe { std::mem::zeroed() };
    message.msg_iov = parts.cast_mut();
    message.msg_iovlen = length;
    // SAFETY: the caller's parts, and a message that is valid for the call.
    unsafe { recvmsg(file, &raw mut message, 0) }
}

/// Waits for a connection, as long as the listener's time-out allows; the connection has the same.
fn accepted(listener: c_int, take: impl Fn() -> c_int) -> c_int {
    let timed = page().zip(receive_ns(listener)).filter(|_| blocks(listener));
    if let Some((page, ns)) = timed {
        let mut asked = [pollfd { fd: listener, events: libc::POLLIN, revents: 0 }];
        match wait_until(page, &mut asked, after(page, ns), std::ptr::null()) {
            Some(0) => {
                errno::set(libc::EAGAIN);
                return -1;
            }
            Some(1..) | None => {}
            Some(_) => return -1,
        }
    }
    let taken = take();
    if taken >= 0 {
        forget(taken);
        if let Some(ns) = receive_ns(listener) {
            set_receive_ns(taken, ns);
        }
    }
    taken
}

#[unsafe(no_mangle)]
unsafe extern "C" fn accept(listener: c_int, from: *mut sockaddr, size: *mut socklen_t) -> c_int {
    accepted(
        listener,
        || real!(accept(listener => c_int, from => *mut sockaddr, size => *mut socklen_t) -> c_int),
    )
}

#[unsafe(no_mangle)]
unsafe extern "C" fn accept4(
    listener: c_int,
    from: *mut sockaddr,
    size: *mut socklen_t,
    flags: c_int,
) -> c_int {
    accepted(listener, || {
        real!(accept4(
            listener => c_int,
            from => *mut sockaddr,
            size => *mut socklen_t,
            flags => c_int,
        ) -> c_int)
    })
}

/// What `recv` is where a compiler checks sizes.
#[unsafe(no_mangle)]
unsafe extern "C" fn __recv_chk(
    socket: c_int,
    buffer: *mut c_void,
    size: size_t,
    _: size_t,
    flags: c_int,
) -> ssize_t {
    // SAFETY: the caller's.
    unsafe { recv(socket, buffer, size, flags) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn __read_chk(file: c_int, buffer: *mut c_void, size: size_t, _: size_t) -> ssize_t {
    // SAFETY: the caller's.
    unsafe { read(file, buffer, size) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn __recvfrom_chk(
    socket: c_int,
    buffer: *mut c_void,
    size: size_t,
    _: size_t,
    flags: c_int,
    from: *mut sockaddr,
    from_size: *mut socklen_t,
) -> ssize_t {
    // SAFETY: the caller's.
    unsafe { recvfrom(socket, buffer, size, flags, from, from_size) }
}
