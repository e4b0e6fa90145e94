//! Hex dumps whose lines begin with their address: those of `xxd`, `hexdump -C`, `od -t x1` and Wireshark, with or without the text beside.
//!
//! A plain hex file may begin with digits that look like an address. A first word is taken for one where a mark says so (a colon, a text
//! between bars, a `*` for repeated lines), or where it counts: the second line's is the first's and as many as bytes stand between, each of
//! two digits. All lines must then keep to it, or the dump is refused.

use super::ReadError;
use super::hex::{hex_line, words};
use crate::{Joint, Packet};

/// Lines by which a dump is recognised: behind these, an octal address is none in hex.
const HEAD: usize = 64;
/// Fewest digits of an address (Wireshark's), and fewest of one that may begin elsewhere than at 0 without a mark.
const ADDRESS_DIGITS: usize = 4;
const LONG_ADDRESS_DIGITS: usize = 6;
/// Most bytes that `*` may stand for in one text: a few letters must not become gigabytes.
const MOST_REPEATED: u64 = 16 * 1024 * 1024;
/// Bases of addresses: of most programs, of `od`, and of `od -A d` and `xxd -d`.
const RADIXES: [u32; 3] = [16, 8, 10];

/// What a dump of words is told as.
const OF_WORDS: &str = "a hex dump of words, which have other bytes first or are no hex (`hexdump` and `od` without options write such): \
                        dump the file again with `xxd FILE` or `hexdump -C FILE`";

/// A line that is no comment.
#[derive(Clone, Copy)]
enum Line<'a> {
    Row(Row<'a>),
    /// `*`, for lines that are as the one before.
    Repeat(usize),
    /// Anything else.
    Other(usize, &'a str),
}

#[derive(Clone, Copy)]
struct Row<'a> {
    /// From 1 on.
    number: usize,
    address: &'a str,
    colon: bool,
    /// What stands behind the address.
    rest: &'a str,
}

/// How the lines of a dump are laid out.
#[derive(Clone, Copy)]
struct Layout {
    radix: u32,
    /// Bytes of a line's rest that hold its data: what is behind them is text.
    width: usize,
    /// Digits of the first address. None has fewer.
    digits: usize,
}

/// The bytes of a dump with addresses; none where it is none. A dump that begins anew at 0 is a packet of its own.
pub(super) fn packets(text: &str) -> Result<Option<Vec<Packet>>, ReadError> {
    let head: Vec<Line<'_>> = lines(text).take(HEAD).collect();
    let Some(Line::Row(first)) = head.first().copied() else { return Ok(None) };
    let marked = first.is_marked() || head.iter().any(|line| matches!(line, Line::Repeat(_)));
    let layouts = || RADIXES.into_iter().filter_map(|radix| Layout::of(&head, first, radix, marked));
    let read = layouts().filter_map(|layout| Some((layout, walk(head.iter().copied(), layout).ok()?)));
    let mut read: Vec<_> = read.collect();
    // Addresses in hex count as octal ones, too, if half of each line is taken for text.
    read.sort_by_key(|(layout, _)| std::cmp::Reverse(layout.width));
    if let Some((layout, bytes)) = read.first() {
        let layout = *layout;
        if read.iter().any(|(other, found)| other.width == layout.width && found != bytes) {
            return Err(ambiguous(&head, first));
        }
        if first.is_swapped(layout) {
            return Err(ReadError::Foreign { what: OF_WORDS });
        }
        let packet = |bytes| Packet { bytes, joint: Joint::Anew, ..Packet::default() };
        return walk(lines(text), layout).map(|dumps| Some(dumps.into_iter().map(packet).collect()));
    }
    if is_of_words(&head, first, marked) {
        return Err(ReadError::Foreign { what: OF_WORDS });
    }
    if let Some(layout) = layouts().next() {
        return walk(lines(text), layout).map(|_| None);
    }
    Ok(None)
}

/// The lines that are no comments.
fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let lines = (1..).zip(text.lines().map(str::trim));
    lines.filter(|(_, line)| !line.is_empty() && !line.starts_with([';', '#'])).map(|(number, line)| {
        if line == "*" {
            return Line::Repeat(number);
        }
        let (word, rest) =
            line.split_at_checked(line.find(char::is_whitespace).unwrap_or(line.len())).unwrap_or((line, ""));
        let address = word.strip_suffix(':').unwrap_or(word);
        match address.len() >= ADDRESS_DIGITS && address.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            true => Line::Row(Row { number, address, colon: address.len() < word.len(), rest }),
            false => Line::Other(number, line),
        }
    })
}

impl<'a> Row<'a> {
    fn address(self, radix: u32) -> Option<u64> {
        u64::from_str_radix(self.address, radix).ok()
    }

    /// Whether a dump may begin with its address, without a mark.
    fn may_begin(self) -> bool {
        self.address.len() >= LONG_ADDRESS_DIGITS || self.address(16) == Some(0)
    }

    /// Whether its first word is an address for certain.
    fn is_marked(self) -> bool {
        let data = self.marked_data();
        let barred = [('|', '|'), ('>', '<')].into_iter().any(|(open, close)| {
            self.rest.ends_with(close) && self.rest.find(open).is_some_and(|at| at + 1 < self.rest.len())
        });
        (self.colon || barred || self.leads()) && words(data).next().is_some() && hex_line(data).is_ok()
    }

    /// Whether its first word leads the others: it is 0, a gap stands behind it, and bytes of two digits each.
    fn leads(self) -> bool {
        let data = self.rest.split_at_checked(self.gap()).map_or("", |(data, _)| data);
        self.address(16) == Some(0) && self.rest.starts_with("  ") && words(data).all(|word| word.len() == 2)
    }

    /// Where three blanks stand behind its first bytes: `hexdump -C` has two in the middle of a line.
    fn gap(self) -> usize {
        let lead = self.rest.len() - self.rest.trim_start().len();
        let gap = self.rest.get(lead..).and_then(|rest| rest.find("   "));
        gap.map_or(self.rest.len(), |at| lead + at)
    }

    /// Where its data end by marks alone: before a bar, or behind a colon before two blanks.
    fn unmeasured(self) -> usize {
        let lead = self.rest.len() - self.rest.trim_start().len();
        let end = match self.colon {
            true => self.rest.get(lead..).and_then(|rest| rest.find("  ")).map(|at| lead + at),
            false => self.rest.find(['|', '>']).or_else(|| self.leads().then(|| self.gap())),
        };
        end.unwrap_or(self.rest.len())
    }

    /// Its data by marks alone.
    fn marked_data(self) -> &'a str {
        self.rest.get(..self.unmeasured()).unwrap_or(self.rest)
    }

    /// Where its first `count` bytes end; none where they end inside a word, or are not so many.
    fn measured(self, count: u64) -> Option<usize> {
        let (mut at, mut found) = (0, 0);
        for piece in self.rest.split_inclusive(char::is_whitespace) {
            let word = piece.trim_end();
            if !word.is_empty() {
                found += self.bytes(word).ok()?.len() as u64;
                if found == count {
                    return Some(at + word.len());
                }
            }
            at += piece.len();
        }
        None
    }

    /// The bytes of these words of it. Without a colon, no program writes longer ones in order.
    fn bytes(self, data: &str) -> Result<Vec<u8>, ReadError> {
        let found = match words(data).find(|word| !self.colon && word.len() != 2) {
            Some(word) => Err(word.chars().take(20).collect()),
            None => hex_line(data),
        };
        found.map_err(|found| ReadError::NotHex { line: self.number, found })
    }

    /// Its data: what the first line's width holds, and of a longer line what goes on behind it without a gap, which text beside has.
    fn data(self, width: usize) -> &'a str {
        let beyond = self.rest.get(width..).unwrap_or_default();
        let more = match beyond.trim_start_matches(' ').starts_with(['|', '>']) {
            true => 0,
            false => beyond.find("  ").unwrap_or(beyond.len()),
        };
        let data = self.rest.get(..width + more).unwrap_or(self.rest);
        data.split([';', '#']).next().unwrap_or_default()
    }

    /// Whether the text beside shows that the bytes of each word stand the other way round, as `xxd -e` writes them.
    fn is_swapped(self, layout: Layout) -> bool {
        let text = self.rest.get(layout.width..).and_then(|text| text.strip_prefix("  ")).unwrap_or_default();
        let shows = |bytes: &[u8]| {
            let same =
                |(byte, shown): (&u8, char)| !matches!(byte, b' '..=b'~') || char::from(*byte) == shown;
            bytes.iter().zip(text.chars()).all(same)
        };
        let word = |word| hex_line(word).unwrap_or_default();
        let in_order: Vec<u8> = words(self.data(layout.width)).flat_map(word).collect();
        let swapped: Vec<u8> =
            words(self.data(layout.width)).flat_map(|it| word(it).into_iter().rev()).collect();
        !text.is_empty() && !shows(&in_order) && shows(&swapped)
    }
}

impl Layout {
    /// How lines are laid out that begin so, if their addresses are such numbers.
    fn of(head: &[Line<'_>], first: Row<'_>, radix: u32, marked: bool) -> Option<Self> {
        let address = first.address(radix)?;
        let digits = first.address.len();
        let counted = match head.get(1) {
            Some(Line::Row(second)) => second.address(radix)?.checked_sub(address).filter(|bytes| *bytes > 0),
            _ => None,
        };
        let width = match counted {
            Some(bytes) => first.measured(bytes)?,
            None => marked.then(|| first.unmeasured())?,
        };
        (first.may_begin() || marked).then_some(Self { radix, width, digits })
    }

    /// An address as such a dump writes it.
    fn show(self, address: u64) -> String {
        let digits = self.digits;
        match self.radix {
            8 => format!("{address:0digits$o}"),
            10 => format!("{address:0digits$}"),
            _ => format!("{address:0digits$x}"),
        }
    }
}

/// The bytes of each dump in these lines, whose every address counts them.
fn walk<'a>(lines: impl Iterator<Item = Line<'a>>, layout: Layout) -> Result<Vec<Vec<u8>>, ReadError> {
    let mut dumps: Vec<Vec<u8>> = Vec::new();
    let mut dump: Vec<u8> = Vec::new();
    // Where the next line should begin, once there was one; bytes of the last one; whether it was repeated; bytes so far.
    let (mut next, mut last, mut repeats, mut repeated) = (None, 0, false, 0);
    for line in lines {
        let row = match line {
            Line::Row(row) => row,
            Line::Repeat(_) if last > 0 => {
                repeats = true;
                continue;
            }
            Line::Repeat(line) => return Err(no_address(line, "*", layout, next.unwrap_or_default())),
            Line::Other(line, found) => {
                return Err(no_address(line, found, layout, next.unwrap_or_default()));
            }
        };
        let wrong = || no_address(row.number, row.address, layout, next.unwrap_or_default());
        let address =
            row.address(layout.radix).filter(|_| row.address.len() >= layout.digits).ok_or_else(wrong)?;
        let expected = *next.get_or_insert(address);
        match address.checked_sub(expected) {
            Some(0) => {}
            Some(missing) if repeats && missing.is_multiple_of(last) => {
                repeated += missing;
                if repeated > MOST_REPEATED {
                    return Err(ReadError::Line {
                        line: row.number,
                        expected: format!("at most {MOST_REPEATED} bytes of lines that `*` stands for"),
                        found: row.address.to_owned(),
                    });
                }
                let from = dump.len().saturating_sub(usize::try_from(last).unwrap_or_default());
                let line = dump.get(from..).unwrap_or_default().to_vec();
                (0..missing / last).for_each(|_| dump.extend_from_slice(&line));
            }
            None if address == 0 => dumps.push(std::mem::take(&mut dump)),
            _ => return Err(no_address(row.number, row.address, layout, expected)),
        }
        let bytes = row.bytes(row.data(layout.width))?;
        (last, repeats) = (bytes.len() as u64, false);
        next = Some(address.saturating_add(last));
        dump.extend(bytes);
    }
    dumps.push(dump);
    dumps.retain(|dump| !dump.is_empty());
    Ok(dumps)
}

fn no_address(line: usize, found: &str, layout: Layout, expected: u64) -> ReadError {
    ReadError::Line {
        line,
        expected: format!(
            "the address {}, as the dump's lines before have bytes; dump the file again with `xxd FILE`",
            layout.show(expected)
        ),
        found: found.chars().take(40).collect(),
    }
}

/// A dump that begins with repeated lines, whose addresses may be octal as well as hex.
fn ambiguous(head: &[Line<'_>], first: Row<'_>) -> ReadError {
    let repeat = head.iter().find_map(|line| if let Line::Repeat(line) = line { Some(*line) } else { None });
    ReadError::Line {
        line: repeat.unwrap_or(first.number),
        expected: "a dump of all lines, as this one's addresses may be octal or hex: dump the file again with `xxd FILE` or `od -v`"
            .to_owned(),
        found: "*".to_owned(),
    }
}

/// Whether the words of these lines are as many as their addresses say, and no bytes in order.
fn is_of_words(head: &[Line<'_>], first: Row<'_>, marked: bool) -> bool {
    let count = |row: Row<'_>| words(row.marked_data()).count() as u64;
    let agrees = |radix: u32, size: u64| {
        let mut pairs = head.windows(2).filter_map(|pair| match pair {
            [Line::Row(row), Line::Row(after)] => {
                let bytes = after.address(radix)?.checked_sub(row.address(radix)?)?;
                // The last word of a file may be half a word.
                let least = if after.rest.is_empty() { 1 } else { size };
                Some((count(*row) * size, bytes, least))
            }
            _ => None,
        });
        let fits = |(most, bytes, least): (u64, u64, u64)| {
            bytes > 0 && bytes <= most && bytes + size >= most + least
        };
        pairs.clone().next().is_some() && pairs.all(fits)
    };
    let lengths = || words(first.marked_data()).map(str::len);
    let alike = lengths().next().is_some_and(|length| length != 2 && lengths().all(|other| other == length));
    let counted = RADIXES.into_iter().any(|radix| [1, 2, 4, 8].into_iter().any(|size| agrees(radix, size)));
    alike && ((counted && (marked || first.may_begin())) || (marked && !first.colon))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes with lines that repeat, and a last line that is short.
    fn sample() -> Vec<u8> {
        [&b"\x02sRN DeviceIdent\x03\x02sRA STlms 7 0 8 |>;# ab  12<"[..], &[0; 70], b"ab"].concat()
    }

    /// The sample as a program writes it: an address, groups, and the text between its marks; repeated lines as `*` where wanted.
    fn dump(
        address: impl Fn(usize) -> String,
        groups: &str,
        text: Option<(&str, &str)>,
        star: bool,
        end: bool,
    ) -> String {
        let bytes = sample();
        let mut out = String::new();
        let mut before: Option<&[u8]> = None;
        let mut starred = false;
        for (at, line) in bytes.chunks(16).enumerate() {
            if star && before == Some(line) {
                out.push_str(if starred { "" } else { "*\n" });
                starred = true;
                continue;
            }
            (before, starred) = (Some(line), false);
            let mut data = String::new();
            for (place, byte) in line.iter().enumerate() {
                data.push_str(&format!("{byte:02x}"));
                data.push_str(match groups {
                    "2" if place % 2 == 0 => "",
                    "8" if place == 7 => "  ",
                    _ => " ",
                });
            }
            out.push_str(&address(at * 16));
            match text {
                None => out.push_str(data.trim_end()),
                Some((open, close)) => {
                    let wide = match groups {
                        "2" => 40,
                        "8" => 49,
                        _ => 48,
                    };
                    let shown = |byte: &u8| if matches!(byte, b' '..=b'~') { char::from(*byte) } else { '.' };
                    let shown: String = line.iter().map(shown).collect();
                    out.push_str(&format!("{data:<wide$} {open}{shown}{close}"));
                }
            }
            out.push('\n');
        }
        if end {
            out.push_str(address(bytes.len()).trim_end_matches([' ', ':']));
            out.push('\n');
        }
        out
    }

    fn read(text: &str) -> Result<Option<Vec<Vec<u8>>>, String> {
        let packets = packets(text).map_err(|error| error.to_string())?;
        Ok(packets.map(|packets| packets.into_iter().map(|packet| packet.bytes).collect()))
    }

    #[test]
    fn dumps_of_bytes_in_order_are_read_with_text_and_without() {
        for (program, text) in [
            ("xxd", dump(|at| format!("{at:08x}: "), "2", Some(("", "")), false, false)),
            ("xxd -a", dump(|at| format!("{at:08x}: "), "2", Some(("", "")), true, false)),
            ("xxd -g1", dump(|at| format!("{at:08x}: "), "1", Some(("", "")), false, false)),
            ("xxd -d", dump(|at| format!("{at:08}: "), "2", Some(("", "")), false, false)),
            ("xxd | cut", dump(|at| format!("{at:08x}: "), "2", None, false, false)),
            ("hexdump -C", dump(|at| format!("{at:08x}  "), "8", Some(("|", "|")), true, true)),
            ("hexdump -C -v", dump(|at| format!("{at:08x}  "), "8", Some(("|", "|")), false, true)),
            ("hexdump -C | cut", dump(|at| format!("{at:08x}  "), "8", None, true, true)),
            ("od -A x -t x1 -v", dump(|at| format!("{at:06x} "), "1", None, false, true)),
            ("od -A x -t x1z -v", dump(|at| format!("{at:06x} "), "1", Some((" >", "<")), false, true)),
            ("od -t x1", dump(|at| format!("{at:07o} "), "1", None, true, true)),
            ("od -A d -t x1", dump(|at| format!("{at:07} "), "1", None, true, true)),
            ("Wireshark", dump(|at| format!("{at:04x}   "), "8", Some(("  ", "")), false, false)),
        ] {
            assert_eq!(read(&text), Ok(Some(vec![sample()])), "{program}:\n{text}");
            // Two of them behind one another begin anew.
            assert_eq!(read(&text.repeat(2)), Ok(Some(vec![sample(); 2])), "{program} twice");
        }
    }

    /// Dumps of a telegram a line, joined by hand: each line has its own length.
    #[test]
    fn lines_of_other_lengths_lose_nothing() {
        let s = "02 73 52 4e 20 53 54 6c 6d 73 03";
        let bytes = b"\x02sRN STlms\x03";
        for (text, telegrams) in [
            (format!("0000 {s}\n000b {s}\n0016 {s} {s}\n"), 4),
            (format!("0000 {s}\n000b {s} {s}\n0021 {s}\n"), 4),
            (format!("00000000: {s}\n0000000b: {s} {s}\n"), 3),
            (format!("0000   {s} {s}\n0016   {s}\n0021   {s} {s} {s}\n"), 6),
            (format!("0000   {s}\n"), 1),
            (format!("00000000  {s}\n"), 1),
            (format!("0000   {s}                  .sRN STlms.\n"), 1),
        ] {
            assert_eq!(read(&text), Ok(Some(vec![bytes.repeat(telegrams)])), "{text}");
        }
        let two =
            format!("0000   {s}                  .sRN STlms.\n\n0000   {s}                  .sRN STlms.\n");
        assert_eq!(read(&two), Ok(Some(vec![bytes.to_vec(); 2])), "{two}");
    }

    #[test]
    fn plain_hex_that_begins_like_an_address_is_none() {
        for plain in [
            "00000000 02 73 03\n00000000 02 73 03\n",
            "000000 02 73 03\n000010 02 73 03\n",
            "00000000 00000010 02 73\n00000010 00000010 03 02\n",
            "0273 524e 0302\n0302 7352 4e03\n",
            "02 73 03\n",
            "00000000 02 73 03",
            "",
        ] {
            assert_eq!(read(plain), Ok(None), "{plain}");
        }
    }

    #[test]
    fn a_dump_of_words_is_refused_with_the_remedy() {
        for words in [
            "0000000 7302 4e52 4420 7665\n0000008 0003\n0000009\n",
            "0000000 7302 4e52\n*\n0000010\n",
            "0000000    7302    4e52\n0000004\n",
            "0000000 071402 047122\n0000004\n",
            "0000000 4e527302 76654420\n0000010\n",
            "00000000: 4e527302 76654420 49656369 746e6564  .sRN DeviceIdent\n00000010: 03\n",
            "00000000: 00000010 01110011  .s\n00000002: 01110011  s\n",
        ] {
            let error = read(words).expect_err(words);
            assert!(error.contains("words") && error.contains("`xxd FILE`"), "{words}: {error}");
        }
        // In order, of four bytes each.
        let text = "00000000: 0273524e 20446576 69636549 64656e74  .sRN DeviceIdent\n00000010: 03                                   .\n";
        assert_eq!(read(text), Ok(Some(vec![b"\x02sRN DeviceIdent\x03".to_vec()])));
    }

    #[test]
    fn a_dump_with_a_hole_is_refused_with_its_line() {
        let text = dump(|at| format!("{at:08x}: "), "2", Some(("", "")), false, false);
        let holed: Vec<&str> =
            text.lines().enumerate().filter(|(at, _)| *at != 2).map(|(_, line)| line).collect();
        let error = read(&holed.join("\n")).expect_err("a hole");
        assert!(error.starts_with("line 3: ") && error.contains("00000020"), "{error}");
    }

    #[test]
    fn repeated_lines_without_a_sure_base_or_without_an_end_are_refused() {
        let line = "0000000 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00\n*\n";
        let error = read(&format!("{line}0000160\n")).expect_err("octal or hex");
        assert!(error.starts_with("line 2: ") && error.contains("`od -v`"), "{error}");
        let error =
            read(&format!("{}*\nfffffff0\n", "00000000  00 00\n00000002  00 00\n")).expect_err("too many");
        assert!(error.contains("at most"), "{error}");
    }
}
