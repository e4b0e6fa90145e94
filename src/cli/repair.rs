//! Recordings written anew: `record --repair`, and `record RECORDING -o FILE`.

use std::fs;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use rowscan_driver::Source;
use rowscan_files::{OutputFile, is_standard_output};
use rowscan_recording::{About, Copied, CopyError, Format, Repaired, Torn, copy, repair};

use super::output::{name_of, say};
use super::recorder::{self, DecodedArgs};
use super::recording_file::{no_stream, open, open_stream, tell_capture, tell_damage, unreadable};
use super::{Failure, Outcome};

/// `record --repair FILE`: to `output`, or in its place if it is an MCAP file that breaks off.
pub(super) fn run(
    file: &Path,
    output: Option<&Path>,
    about: About,
    decoded: DecodedArgs,
) -> Result<Outcome, Failure> {
    let format = open(file)?.format();
    match output {
        Some(output) if format == Format::Mcap => mend_to(file, output, decoded),
        Some(output) => convert(file, None, output, about, decoded),
        None if format != Format::Mcap => Err(Failure::Usage(format!(
            "{} is no MCAP file ({format}) and stays as it is: add `-o NEW.mcap` to write what it holds to a new file",
            file.display()
        ))),
        None => in_place(file, decoded),
    }
}

/// Writes a recording of any kind, or one `stream` of it, to a new MCAP file.
pub(super) fn convert(
    file: &Path,
    stream: Option<&str>,
    output: &Path,
    about: About,
    decoded: DecodedArgs,
) -> Result<Outcome, Failure> {
    let recording = open_stream(file, stream)?;
    let is = (recording.format(), recording.main_kind());
    let outcome = tell_capture(file, &recording);
    // It may say so only behind its first packets.
    let ahead = Source::Recording { path: file.to_owned(), stream: None }.peek();
    let about = ahead.map_or_else(About::default, |ahead| ahead.about().clone()).or(about);
    refuse_to_overwrite(output)?;
    let about = About { source: Some(file.display().to_string()), ..about };
    let mut out = BufWriter::new(OutputFile::create(output).map_err(|cause| unwritable(output, cause))?);
    let Copied { recorded, torn, soundness } = copy(recording, stream, &mut out, about, decoded.into())
        .map_err(|error| failure(file, output, error))?;
    tell_damage(file, is, soundness)?;
    if recorded.packets == 0 {
        return Err(nothing_in(file));
    }
    commit(out, output)?;
    recorder::tell(output, &recorded);
    Ok(match torn {
        Some(torn) => {
            let (file, part) = (file.display(), torn.read_part());
            say(format_args!("{file}: {torn}; {} holds {part}", name_of(output)));
            Outcome::Finding
        }
        None => outcome,
    })
}

fn in_place(file: &Path, decoded: DecodedArgs) -> Result<Outcome, Failure> {
    let original = beside(file);
    if fs::symlink_metadata(&original).is_ok() {
        return Err(Failure::Usage(format!(
            "{} would be kept as {1}, which exists already: move {1} away, or name another file with -o",
            file.display(),
            original.display()
        )));
    }
    let mut out = BufWriter::new(OutputFile::create_anew(file).map_err(|cause| unwritable(file, cause))?);
    let repaired = rewrite(file, file, &mut out, decoded)?;
    if repaired.torn.is_none() {
        say(format_args!("{} is whole: nothing to repair", file.display()));
        return Ok(Outcome::Done);
    }
    keep_original(file, &original).map_err(|cause| unwritable(&original, cause))?;
    commit(out, file)?;
    let outcome = tell_repaired(file, &repaired);
    say(format_args!("the file as it was is {}", original.display()));
    Ok(outcome)
}

fn mend_to(file: &Path, output: &Path, decoded: DecodedArgs) -> Result<Outcome, Failure> {
    refuse_to_overwrite(output)?;
    let mut out = BufWriter::new(OutputFile::create(output).map_err(|cause| unwritable(output, cause))?);
    let repaired = rewrite(file, output, &mut out, decoded)?;
    commit(out, output)?;
    Ok(tell_repaired(output, &repaired))
}

/// Writes all that can be read of an MCAP file.
fn rewrite(
    file: &Path,
    output: &Path,
    out: &mut BufWriter<OutputFile>,
    decoded: DecodedArgs,
) -> Result<Repaired, Failure> {
    if decoded.is_set() {
        return Err(Failure::Usage(format!(
            "a repaired MCAP file keeps the channels it has: leave out --decoded, or convert it with `rowscan record {} -o NEW.mcap`",
            file.display()
        )));
    }
    let unread = |cause: io::Error| unreadable(file, cause.into());
    let mut input = rowscan_files::open(file).map_err(unread)?;
    let length = input.metadata().map_err(unread)?.len();
    let repaired = repair(&mut input, length, out).map_err(|error| failure(file, output, error))?;
    if repaired.messages == 0 {
        return Err(nothing_in(file));
    }
    if let Some(torn) = &repaired.torn {
        say(format_args!("{}: {torn}", file.display()));
    }
    Ok(repaired)
}

/// Says what was written: packets, and what was decoded beside them, for a repaired file keeps every channel. What stands behind a whole file is not mended by leaving
/// it out.
fn tell_repaired(file: &Path, Repaired { messages, bytes, torn, .. }: &Repaired) -> Outcome {
    say(format_args!("{}: {messages} messages of all channels, {bytes} bytes written", name_of(file)));
    if torn.as_ref().is_some_and(Torn::is_behind) { Outcome::Finding } else { Outcome::Done }
}

/// `FILE.orig`
fn beside(file: &Path) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(".orig");
    PathBuf::from(name)
}

/// Gives the file a second name, so that it survives what replaces it. Where it would be written in place (it has several names, or
/// is a link), or the file system has no second names, it is copied.
fn keep_original(file: &Path, original: &Path) -> io::Result<()> {
    let found = fs::symlink_metadata(file)?;
    if found.is_file() && !has_several_names(&found) && fs::hard_link(file, original).is_ok() {
        return Ok(());
    }
    let mut copy = fs::OpenOptions::new().write(true).create_new(true).open(original)?;
    io::copy(&mut rowscan_files::open(file)?, &mut copy)?;
    copy.sync_all()
}

#[cfg(unix)]
fn has_several_names(found: &fs::Metadata) -> bool {
    std::os::unix::fs::MetadataExt::nlink(found) > 1
}

#[cfg(not(unix))]
fn has_several_names(_: &fs::Metadata) -> bool {
    true
}

fn refuse_to_overwrite(output: &Path) -> Result<(), Failure> {
    let holds_bytes = || output.metadata().is_ok_and(|found| found.is_file() && found.len() > 0);
    if !is_standard_output(output) && holds_bytes() {
        let found = output.display();
        return Err(Failure::Usage(format!("{found} exists already; choose another name, or move it away")));
    }
    Ok(())
}

fn commit(out: BufWriter<OutputFile>, output: &Path) -> Result<(), Failure> {
    let out = out.into_inner().map_err(io::IntoInnerError::into_error);
    out.and_then(OutputFile::commit).map_err(|cause| unwritable(output, cause))
}

fn unwritable(output: &Path, cause: io::Error) -> Failure {
    Failure::Write { what: name_of(output), cause }
}

fn failure(file: &Path, output: &Path, error: CopyError) -> Failure {
    match error {
        CopyError::Read(cause) => unreadable(file, cause),
        CopyError::Write(cause) => unwritable(output, cause),
        CopyError::NoStream { wanted, found } => no_stream(file, wanted, found),
    }
}

fn nothing_in(file: &Path) -> Failure {
    Failure::Usage(format!("{} holds no packet that can be read: nothing was written", file.display()))
}
