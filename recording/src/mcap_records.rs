//! The records of an MCAP file, one after the other, past whatever is damaged between them.
//!
//! A record says how long it is, so one wrong length, or a hole of zeros, hides all that follows. One is taken as whole if what stands behind it may be a record, too. Else the next place is looked for from which whole records follow ([`CHAIN`] of them, or two up to the file's end); what lies
//! between is lost, and told. Records of a chunk without compression lie in the file like others, so a hole in it costs no more than itself.

use std::collections::BTreeSet;
use std::io::Read;

use flate2::Crc;
use mcap::MAGIC;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::mcap_damage::Damage;
use crate::mcap_record;
use crate::read::{ReadError, Torn};
use crate::read_some::read_some;

/// Opcode and length.
const HEAD: usize = 9;

/// So many whole records in a row are none by chance.
const CHAIN: usize = 3;

/// A chunk with compression is unpacked whole, and may have so many times the bytes of a record.
const LONGEST_CHUNK: usize = 16;

/// Bytes that are read at a time.
const PIECE: usize = 64 * 1024;

/// What has been looked through for the next whole record is let go in parts of this size.
const LOOKED_THROUGH: usize = 1024 * 1024;

/// Bytes of a chunk's head up to the name of its compression.
const CHUNK_HEAD: usize = 8 + 8 + 8 + 4 + 4;

/// Where in the file the next record is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Section {
    Data,
    /// Behind the data: it repeats what was read.
    Summary,
    /// The footer was read, or the file cannot be read on.
    End,
}

/// A chunk without compression whose records are being read.
struct OpenChunk {
    /// The byte of the file where it ends.
    end: u64,
    /// Its checksum; 0 for none.
    crc: u32,
    found: Crc,
}

/// A chunk with compression whose records are being read.
struct Packed {
    begins: u64,
    reader: LinearReader,
    bytes: std::io::Cursor<Vec<u8>>,
}

/// What stands at a place.
enum Look {
    /// A record that can be read, of so many bytes.
    Whole(usize),
    /// The file ends there.
    End,
    /// The file ends within what may be a record.
    Cut,
    /// No record.
    Bad(String),
}

/// Which bytes the record that was found has.
enum Place {
    /// So many, which begin so many before the next one.
    File(usize),
    /// Those that were unpacked last.
    Unpacked,
}

/// Reads record after record.
pub(crate) struct Records<R> {
    input: R,
    /// What was read and not used up; it begins at `base` of the file.
    buffer: Vec<u8>,
    at: usize,
    base: u64,
    ended: bool,
    longest: usize,
    section: Section,
    channels: BTreeSet<u16>,
    chunk: Option<OpenChunk>,
    packed: Option<Box<Packed>>,
    unpacked: Vec<u8>,
    /// Of all data, as long as it means anything.
    data_crc: Crc,
    damage: Damage,
}

impl<R: Read> Records<R> {
    /// Longer records than `longest` bytes are damage.
    pub(crate) fn new(input: R, longest: usize) -> Self {
        Self {
            input,
            buffer: Vec::new(),
            at: 0,
            base: 0,
            ended: false,
            longest,
            section: Section::Data,
            channels: BTreeSet::new(),
            chunk: None,
            packed: None,
            unpacked: Vec::new(),
            data_crc: Crc::new(),
            damage: Damage::default(),
        }
    }

    /// What is missing, once there is no next record.
    pub(crate) fn torn(&self) -> Option<&Torn> {
        self.damage.torn()
    }

    /// The next record of the data; none at their end, or where the file breaks off.
    pub(crate) fn next_record(&mut self) -> Result<Option<Record<'_>>, ReadError> {
        let Some((opcode, place)) = self.step()? else { return Ok(None) };
        let data = match place {
            Place::File(len) => {
                self.at.checked_sub(len).and_then(|from| self.buffer.get(from..self.at)).unwrap_or_default()
            }
            Place::Unpacked => self.unpacked.as_slice(),
        };
        // It was read once already.
        Ok(mcap_record::parse(opcode, data).ok())
    }

    /// Goes to the next record: its opcode, and where its content is.
    fn step(&mut self) -> Result<Option<(u8, Place)>, ReadError> {
        if self.position() == 0 && self.section == Section::Data {
            if !self.fill(MAGIC.len())? {
                self.tear("the end of the file".to_owned());
            } else if self.ahead(0, MAGIC.len()) == MAGIC {
                self.consume(MAGIC.len());
            } else {
                self.skip("no MCAP magic".to_owned())?;
            }
        }
        loop {
            if let Some(opcode) = self.unpack()? {
                return Ok(Some((opcode, Place::Unpacked)));
            }
            self.close_chunk();
            if self.section == Section::End {
                return Ok(None);
            }
            let size = match self.look(0)? {
                Look::Whole(size) if self.is_followed(size)? => size,
                Look::Whole(_) => {
                    self.skip("a length that leads to no record".to_owned())?;
                    continue;
                }
                Look::End => {
                    self.tear("the end of the file".to_owned());
                    continue;
                }
                Look::Cut => {
                    self.skip("the end of the file inside a record".to_owned())?;
                    continue;
                }
                Look::Bad(found) => {
                    self.skip(found)?;
                    continue;
                }
            };
            let opcode = self.ahead(0, 1).first().copied().unwrap_or_default();
            let begins = self.position();
            if opcode == op::DATA_END && self.section == Section::Data {
                self.check_data(begins);
            }
            if opcode == op::CHUNK && self.section == Section::Data {
                self.open_chunk()?;
                continue;
            }
            if opcode == op::HEADER && !self.channels.is_empty() && self.is_behind_magic() {
                self.tear(
                    "the beginning of another file, which was joined to it: divide them there".to_owned(),
                );
                continue;
            }
            self.consume(size);
            match opcode {
                op::DATA_END => self.section = Section::Summary,
                op::FOOTER => self.end()?,
                _ if self.section == Section::Data => {
                    self.note_channel(opcode, size - HEAD);
                    return Ok(Some((opcode, Place::File(size - HEAD))));
                }
                _ => {}
            }
        }
    }

    /// The byte of the file where the next record begins.
    fn position(&self) -> u64 {
        self.base + self.at as u64
    }

    /// `len` bytes from `from` on, of those that are there.
    fn ahead(&self, from: usize, len: usize) -> &[u8] {
        let from = self.at.saturating_add(from);
        self.buffer.get(from..from.saturating_add(len)).unwrap_or_default()
    }

    fn u32_at(&self, from: usize) -> u32 {
        self.ahead(from, 4).first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes))
    }

    fn u64_at(&self, from: usize) -> u64 {
        self.ahead(from, 8).first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes))
    }

    /// Reads until `wanted` bytes are there; false if the file ends before.
    fn fill(&mut self, wanted: usize) -> Result<bool, ReadError> {
        while self.buffer.len() - self.at < wanted {
            if self.ended {
                return Ok(false);
            }
            if self.at >= LOOKED_THROUGH {
                self.base += self.at as u64;
                self.buffer.drain(..self.at);
                self.at = 0;
            }
            let used = self.buffer.len();
            self.buffer.resize(used + PIECE, 0);
            let read = read_some(&mut self.input, self.buffer.get_mut(used..).unwrap_or_default())?;
            self.buffer.truncate(used + read);
            self.ended = read == 0;
        }
        Ok(true)
    }

    /// Goes on by so many bytes that are there.
    fn consume(&mut self, bytes: usize) {
        let passed = self.buffer.get(self.at..self.at + bytes).unwrap_or_default();
        if self.section == Section::Data {
            self.data_crc.update(passed);
            if let Some(chunk) = &mut self.chunk {
                chunk.found.update(passed);
            }
        }
        self.at += bytes;
    }

    /// What stands `from` bytes further on. Of a chunk without compression its head is a record.
    fn look(&mut self, from: usize) -> Result<Look, ReadError> {
        if !self.fill(from + HEAD)? {
            let rest = self.buffer.len() - self.at;
            return Ok(if rest > from { Look::Cut } else { Look::End });
        }
        let Some(&opcode) = self.ahead(from, 1).first() else { return Ok(Look::End) };
        let length = self.u64_at(from + 1);
        if opcode == 0 {
            return Ok(Look::Bad("zeros, or a record of kind 0".to_owned()));
        }
        if opcode == op::CHUNK && self.section == Section::Data {
            return self.look_at_chunk(from, length);
        }
        let Some(length) = usize::try_from(length).ok().filter(|length| *length <= self.longest) else {
            return Ok(Look::Bad(format!("a record of {length} bytes")));
        };
        if !self.fill(from + HEAD + length)? {
            return Ok(Look::Cut);
        }
        if self.section == Section::Data
            && self.chunk.as_ref().is_some_and(|chunk| {
                self.position() + ((from + HEAD + length) as u64) > chunk.end
                    && self.position() + (from as u64) < chunk.end
            })
        {
            return Ok(Look::Bad("a record that goes beyond its chunk's end".to_owned()));
        }
        Ok(match mcap_record::parse(opcode, self.ahead(from + HEAD, length)) {
            Err(found) => Look::Bad(found),
            Ok(Record::Message { header, .. }) if !self.channels.contains(&header.channel_id) => {
                Look::Bad(format!("a message of channel {}, which no record describes", header.channel_id))
            }
            Ok(Record::Schema { header, .. }) if header.id == 0 => {
                Look::Bad("a schema without a number".to_owned())
            }
            Ok(_) => Look::Whole(HEAD + length),
        })
    }

    /// The head of a chunk, and all of one with compression.
    fn look_at_chunk(&mut self, from: usize, length: u64) -> Result<Look, ReadError> {
        if !self.fill(from + HEAD + CHUNK_HEAD)? {
            return Ok(Look::Cut);
        }
        let name = self.u32_at(from + HEAD + CHUNK_HEAD - 4);
        let head = CHUNK_HEAD + name as usize + 8;
        let beyond = || Ok(Look::Bad("a length beyond its record's end".to_owned()));
        let Some(room) = length.checked_sub(head as u64) else { return beyond() };
        let longest = self.longest.saturating_mul(LONGEST_CHUNK);
        let wanted = match usize::try_from(length) {
            _ if name == 0 => head,
            Ok(length) if length <= longest => length,
            _ => return Ok(Look::Bad(format!("a chunk of {length} bytes"))),
        };
        if !self.fill(from + HEAD + wanted)? {
            return Ok(Look::Cut);
        }
        if self.u64_at(from + HEAD + head - 8) > room {
            return beyond();
        }
        if !self.ahead(from + HEAD + CHUNK_HEAD, name as usize).iter().all(u8::is_ascii_graphic) {
            return Ok(Look::Bad("a compression whose name is no word".to_owned()));
        }
        Ok(Look::Whole(HEAD + wanted))
    }

    /// True if what stands `size` bytes further on may be a record, or the file ends there; or if nothing says that this one was too long.
    fn is_followed(&mut self, size: usize) -> Result<bool, ReadError> {
        if self.section == Section::Summary
            || matches!(self.look(size)?, Look::Whole(_) | Look::End | Look::Cut)
        {
            return Ok(true);
        }
        // Damage begins behind it, unless whole records lie within it.
        for from in 1..size {
            if self.begins_chain(from)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// True if whole records follow, one behind the other, from `from` bytes further on.
    fn begins_chain(&mut self, from: usize) -> Result<bool, ReadError> {
        // Messages behind the record of their channel are described by it, as in a chunk whose head is damaged.
        let mut described = Vec::new();
        let begins = self.is_chain(from, &mut described);
        self.channels.retain(|id| !described.contains(id));
        begins
    }

    fn is_chain(&mut self, mut from: usize, described: &mut Vec<u16>) -> Result<bool, ReadError> {
        // Kinds that the format names; others are no sign of anything.
        let named = |opcode: Option<&u8>| matches!(opcode, Some(op::HEADER..=op::DATA_END));
        for whole in 0..CHAIN {
            self.fill(from + HEAD)?;
            match self.ahead(from, 1).first() {
                None => return Ok(whole > 1),
                opcode if !named(opcode) => return Ok(false),
                // A footer is the last one.
                Some(&op::FOOTER) => {
                    return Ok(whole > 0
                        && self.fill(from + HEAD + 20 + MAGIC.len())?
                        && self.ahead(from + HEAD + 20, MAGIC.len()) == MAGIC);
                }
                Some(_) => {}
            }
            match self.look(from)? {
                Look::Whole(size) => {
                    let id = self.ahead(from + HEAD, 2).first_chunk().map(|id| u16::from_le_bytes(*id));
                    let id = id.filter(|_| self.ahead(from, 1) == [op::CHANNEL]);
                    described.extend(id.filter(|id| self.channels.insert(*id)));
                    from += size;
                }
                Look::End | Look::Cut => return Ok(whole > 1),
                Look::Bad(_) => return Ok(false),
            }
        }
        Ok(true)
    }

    /// Leaves out what cannot be read, up to the next whole records; without any, the file breaks off here.
    fn skip(&mut self, found: String) -> Result<(), ReadError> {
        let begins = self.position();
        if self.section == Section::Summary {
            self.tear(found);
            return Ok(());
        }
        let mut from = 1;
        loop {
            if from >= LOOKED_THROUGH {
                self.consume(from);
                from = 0;
            }
            if !self.fill(from + 1)? {
                self.break_off(begins, found);
                return Ok(());
            }
            if self.begins_chain(from)? {
                self.consume(from);
                self.damage.lose(begins, self.position(), found);
                return Ok(());
            }
            from += 1;
        }
    }

    /// Nothing from here on can be read.
    fn tear(&mut self, found: String) {
        self.break_off(self.position(), found);
    }

    fn break_off(&mut self, offset: u64, found: String) {
        self.section = Section::End;
        self.damage.break_off(offset, found);
    }

    fn note_channel(&mut self, opcode: u8, len: usize) {
        let id = self.buffer.get(self.at - len..).and_then(<[u8]>::first_chunk);
        self.channels.extend(id.filter(|_| opcode == op::CHANNEL).map(|id| u16::from_le_bytes(*id)));
    }

    /// At the record that ends the data.
    fn check_data(&mut self, begins: u64) {
        let told = self.u32_at(HEAD);
        if told != 0 && told != self.data_crc.sum() {
            self.damage.doubt(
                begins,
                "the checksum of all data before it",
                "another: some of it was changed",
            );
        }
    }

    /// Behind the footer.
    fn end(&mut self) -> Result<(), ReadError> {
        if self.fill(MAGIC.len())? && self.ahead(0, MAGIC.len()) == MAGIC {
            self.consume(MAGIC.len());
            self.section = Section::End;
            self.look_behind()?;
        } else {
            self.tear("no MCAP magic at the end of the file".to_owned());
        }
        Ok(())
    }

    /// Whether a file begins here: no damage makes its first bytes.
    fn is_behind_magic(&self) -> bool {
        let before = self.at.checked_sub(MAGIC.len()).and_then(|from| self.buffer.get(from..self.at));
        self.section == Section::Data && before == Some(MAGIC)
    }

    /// Behind the end of the file: what stands there is none of it.
    fn look_behind(&mut self) -> Result<(), ReadError> {
        let begins = self.position();
        while self.fill(1)? {
            self.consume(self.buffer.len() - self.at);
        }
        if self.position() > begins {
            let found = "more bytes, as of another file that was joined to it: divide them there";
            self.damage.lose_behind(begins, self.position(), found.to_owned());
        }
        Ok(())
    }

    /// At a chunk that [`Self::look`] took as whole.
    fn open_chunk(&mut self) -> Result<(), ReadError> {
        let begins = self.position();
        let length = self.u64_at(1);
        let (name, crc) = (self.u32_at(HEAD + CHUNK_HEAD - 4), self.u32_at(HEAD + CHUNK_HEAD - 8));
        let head = HEAD + CHUNK_HEAD + name as usize + 8;
        if name == 0 {
            self.consume(head);
            self.chunk = Some(OpenChunk { end: begins + HEAD as u64 + length, crc, found: Crc::new() });
            return Ok(());
        }
        let whole = HEAD + usize::try_from(length).unwrap_or(usize::MAX);
        let bytes = std::io::Cursor::new(self.ahead(0, whole).to_vec());
        self.consume(whole);
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(self.longest);
        self.packed =
            Some(Box::new(Packed { begins, reader: LinearReader::new_with_options(options), bytes }));
        Ok(())
    }

    fn close_chunk(&mut self) {
        let position = self.position();
        if let Some(chunk) = self.chunk.take_if(|chunk| position >= chunk.end)
            && chunk.crc != 0
            && chunk.crc != chunk.found.sum()
        {
            self.damage.doubt(
                chunk.end,
                "the checksum of a chunk that ends here",
                "another: some of it was changed",
            );
        }
    }

    /// The next record of a chunk with compression: its opcode.
    fn unpack(&mut self) -> Result<Option<u8>, ReadError> {
        while let Some(mut packed) = self.packed.take() {
            let why = match packed.reader.next_event() {
                None => continue,
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let read = read_some(&mut packed.bytes, packed.reader.insert(wanted.min(self.longest)))?;
                    packed.reader.notify_read(read);
                    self.packed = Some(packed);
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    match mcap_record::parse(opcode, data) {
                        Ok(record) => {
                            if let Record::Channel(channel) = &record {
                                self.channels.insert(channel.id);
                            }
                            self.unpacked.clear();
                            self.unpacked.extend_from_slice(data);
                            self.packed = Some(packed);
                            return Ok(Some(opcode));
                        }
                        Err(why) => why,
                    }
                }
                Some(Err(mcap::McapError::UnsupportedCompression(found))) => {
                    return Err(ReadError::Compressed { found });
                }
                Some(Err(error)) => error.to_string(),
            };
            let ends = packed.begins + packed.bytes.get_ref().len() as u64;
            self.damage.lose(
                packed.begins,
                ends,
                format!("a chunk that cannot be unpacked to its end: {why}"),
            );
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests;
