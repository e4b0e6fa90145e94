//! Every family of calls that the library stands in for, by a program in C and with a page that is moved by hand.
#![allow(clippy::unwrap_used, clippy::print_stderr, clippy::print_stdout)]
#![cfg(all(target_os = "linux", target_pointer_width = "64"))]

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use rowscan_child_clock::{BenchPage, START_NS, VARIABLE};

/// Beside the program of these tests.
fn library() -> PathBuf {
    let here = std::env::current_exe().unwrap();
    let library = here.parent().unwrap().join("librowscan_child_clock.so");
    assert!(
        library.is_file(),
        "{}: `cargo build -p rowscan-child-clock-preload` makes it",
        library.display()
    );
    library
}

/// The program, compiled once; none, visibly, where there is no compiler.
fn program() -> Option<&'static Path> {
    static PROGRAM: OnceLock<Option<(tempfile::TempDir, PathBuf)>> = OnceLock::new();
    let made = PROGRAM.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("families");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/families.c");
        let mut cc = Command::new("cc");
        cc.args(["-O1", "-pthread", "-w", "-o"]).arg(&program).arg(source);
        let Ok(status) = cc.status() else {
            eprintln!("SKIPPED: families of calls: no cc on this machine");
            return None;
        };
        assert!(status.success());
        Some((folder, program))
    });
    made.as_ref().map(|(_, program)| program.as_path())
}

/// Runs the program in C.
fn run(words: &[&str]) -> Option<(String, Vec<u64>)> {
    Some(run_program(Command::new(program()?).args(words)))
}

/// Runs a program and takes its timers' time when it waits; what it says, and the instants that its timers had, ms.
fn run_program(words: &mut Command) -> (String, Vec<u64>) {
    let folder = tempfile::tempdir().unwrap();
    let page = BenchPage::create(&folder.path().join("page")).unwrap();
    page.set_utc_offset(1_700_000_000_000_000_000 - START_NS as i64);
    let mut child =
        words.env("LD_PRELOAD", library()).env(VARIABLE, page.path()).stdout(Stdio::piped()).spawn().unwrap();
    let begun = Instant::now();
    let (mut fired, mut calm) = (Vec::new(), 0);
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        assert!(begun.elapsed() < Duration::from_secs(20), "{words:?} hangs: {page:?}");
        std::thread::sleep(Duration::from_millis(1));
        // Of several threads each gets the time to begin its wait.
        calm = if page.firing().is_none() && page.earliest().is_some() { calm + 1 } else { 0 };
        if calm >= 20 {
            calm = 0;
            let timer = page.earliest().unwrap();
            page.set(timer.deadline_ns);
            assert_eq!(page.fire_next(timer.deadline_ns), Some(timer));
            fired.push((timer.deadline_ns - START_NS) / 1_000_000);
        }
    };
    assert!(status.success(), "{words:?}: {status}");
    let mut said = String::new();
    std::io::Read::read_to_string(&mut child.stdout.take().unwrap(), &mut said).unwrap();
    assert_eq!(page.earliest(), None, "{words:?} leaves a timer");
    (said.trim().to_owned(), fired)
}

const TIMED_OUT: i32 = 110;
const AGAIN: i32 = 11;

#[test]
fn a_time_out_ends_at_its_exact_instant() {
    let expected = [
        ("nanosleep", 0),
        ("clock_nanosleep", 0),
        ("sleep", 0),
        ("usleep", 0),
        ("poll", 0),
        ("poll_many", 0),
        ("ppoll", 0),
        ("select", 0),
        ("pselect", 0),
        ("epoll_wait", 0),
        ("epoll_pwait", 0),
        ("epoll_pwait2", 0),
        ("timerfd", 1),
        ("cond_timedwait", TIMED_OUT),
        ("cond_clockwait", TIMED_OUT),
        ("cond_monotonic", TIMED_OUT),
        ("sem_timedwait", -TIMED_OUT),
        ("sem_clockwait", -TIMED_OUT),
        ("mutex_timedlock", TIMED_OUT),
        ("futex", -TIMED_OUT),
        ("futex_bitset", -TIMED_OUT),
        ("rcvtimeo_recv", -AGAIN),
        ("rcvtimeo_read", -AGAIN),
        ("rcvtimeo_recvmsg", -AGAIN),
    ];
    for (name, result) in expected {
        let Some((said, fired)) = run(&[name]) else { return };
        assert_eq!((said, fired), (format!("{name} 10000 ms {result}"), vec![10_000]));
    }
}

#[test]
fn what_comes_before_the_time_out_ends_the_wait() {
    let expected = [
        ("poll", "byte", 1),
        ("poll_many", "byte", 100),
        ("ppoll", "byte", 1),
        ("select", "byte", 11),
        ("epoll_wait", "byte", 1),
        ("epoll_pwait2", "byte", 1),
        ("cond_timedwait", "cond", 0),
        ("cond_clockwait", "cond", 0),
        ("sem_timedwait", "sem", 0),
        ("sem_clockwait", "sem", 0),
        ("futex", "word", 0),
        ("futex_bitset", "word", 0),
        ("rcvtimeo_recv", "byte", 1),
        ("rcvtimeo_read", "byte", 1),
        ("rcvtimeo_recvmsg", "byte", 1),
    ];
    for (name, help, result) in expected {
        let Some((said, fired)) = run(&[name, help]) else { return };
        assert_eq!((said, fired), (format!("{name} 3000 ms {result}"), vec![3_000]));
    }
}

#[test]
fn a_timer_descriptor_counts_what_nobody_has_read() {
    let Some((said, fired)) = run(&["timerfd_interval"]) else { return };
    assert_eq!(said.trim_end_matches(|c: char| c.is_ascii_digit()), "timerfd_interval 10000 ms ");
    // The sleep and the third expiration are due together.
    assert!(said.ends_with(" 3") || said.ends_with(" 2"), "{said}");
    assert!(fired.starts_with(&[2_000, 6_000, 10_000]), "{fired:?}");
}

#[test]
fn a_forked_child_waits_by_the_page_too() {
    let Some((said, fired)) = run(&["fork"]) else { return };
    assert_eq!((said.as_str(), fired), ("fork 11000 ms 7", vec![10_000, 11_000]));
}

#[test]
fn all_clocks_are_the_page_s_but_the_processor_s() {
    let Some((said, _)) = run(&["clocks"]) else { return };
    assert_eq!(said, "clocks 0 ms 1700000000");
}

#[test]
fn without_a_page_or_with_a_bad_one_time_is_the_host_s() {
    let Some(program) = program() else { return };
    let folder = tempfile::tempdir().unwrap();
    let bad = folder.path().join("bad");
    std::fs::write(&bad, "no page").unwrap();
    for page in [None, Some(bad)] {
        let mut command = Command::new(program);
        command.arg("clocks").env("LD_PRELOAD", library()).env_remove(VARIABLE);
        command.envs(page.map(|page| (VARIABLE, page)));
        let said = String::from_utf8(command.output().unwrap().stdout).unwrap();
        let seconds: u64 = said.trim().rsplit(' ').next().unwrap().parse().unwrap();
        assert!(seconds > 1_700_000_000, "{said}");
    }
}

/// Tells a program of these tests that it is the child of one.
const CHILD: &str = "ROWSCAN_TEST_CHILD";

/// The standard library's waits, in a process of its own: this same program.
#[test]
fn rust_waits_by_the_page_too() {
    if std::env::var_os(CHILD).is_some() {
        return rust_waits();
    }
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", "rust_waits_by_the_page_too", "--nocapture", "--test-threads", "1"])
        .env(CHILD, "1");
    let (said, fired) = run_program(&mut command);
    let times: Vec<&str> = said.lines().filter_map(|line| line.split("took ").nth(1)).collect();
    assert_eq!(times, ["10s sleep", "10s recv_timeout", "10s park_timeout", "10s wait_timeout", "10s read"]);
    assert_eq!(fired, [10_000, 20_000, 30_000, 40_000, 50_000]);
}

fn rust_waits() {
    use std::io::Read as _;
    let ten = Duration::from_secs(10);
    let took = |name: &str, wait: &mut dyn FnMut()| {
        let begun = Instant::now();
        wait();
        println!("took {:?} {name}", begun.elapsed());
    };
    took("sleep", &mut || std::thread::sleep(ten));
    let (_sender, receiver) = std::sync::mpsc::channel::<()>();
    took("recv_timeout", &mut || assert!(receiver.recv_timeout(ten).is_err()));
    took("park_timeout", &mut || std::thread::park_timeout(ten));
    let (mutex, condition) = (std::sync::Mutex::new(()), std::sync::Condvar::new());
    took("wait_timeout", &mut || {
        assert!(condition.wait_timeout(mutex.lock().unwrap(), ten).unwrap().1.timed_out());
    });
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let mut stream = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    stream.set_read_timeout(Some(ten)).unwrap();
    assert_eq!(stream.read_timeout().unwrap(), Some(ten));
    took("read", &mut || {
        assert_eq!(stream.read(&mut [0]).unwrap_err().kind(), std::io::ErrorKind::WouldBlock);
    });
}
