//! An MCAP file written anew, record by record: all that can be read of a torn one, whoever wrote it.

use std::io::{Read, Seek, Write};

use mcap::records::Record;
use mcap::{Attachment, McapError, WriteOptions, Writer};

use crate::copy::CopyError;
use crate::mcap_records::Records;
use crate::read::Torn;
use crate::writer::{WriteSeek, plain};

/// What a repaired file holds, and what of the torn one is missing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Repaired {
    /// Messages of all channels.
    pub messages: u64,
    /// Bytes in them.
    pub bytes: u64,
    /// Attachments.
    pub attachments: u64,
    /// Metadata records.
    pub metadata: u64,
    /// What cannot be read; none if the file is whole.
    pub torn: Option<Torn>,
}

/// Writes every channel, message, attachment and metadata record of `input` that can be found to `out` as a whole, indexed
/// file. Nothing is decoded and nothing added. `input_bytes`, its length, bounds the length of a record.
pub fn repair(
    input: &mut dyn Read,
    input_bytes: u64,
    out: &mut dyn WriteSeek,
) -> Result<Repaired, CopyError> {
    let mut records = Records::new(input, usize::try_from(input_bytes).unwrap_or(usize::MAX));
    let mut copier = Copier { out: Some(out), writer: None, repaired: Repaired::default() };
    while let Some(record) = records.next_record().map_err(CopyError::Read)? {
        copier.write(record)?;
    }
    let torn = records.torn().cloned();
    Ok(Repaired { torn, ..copier.finish()? })
}

/// The copy, begun once the file's header is known.
struct Copier<W: Write + Seek> {
    out: Option<W>,
    writer: Option<Writer<W>>,
    repaired: Repaired,
}

impl<W: Write + Seek> Copier<W> {
    fn write(&mut self, record: Record<'_>) -> Result<(), CopyError> {
        self.try_write(record).map_err(|error| CopyError::Write(plain(error)))
    }

    fn try_write(&mut self, record: Record<'_>) -> Result<(), McapError> {
        // A file that lost its header is written without its words.
        let found = if let Record::Header(header) = &record { Some(header) } else { None };
        if let Some(out) = self.out.take() {
            let (profile, library) = found
                .map_or_else(Default::default, |header| (header.profile.clone(), header.library.clone()));
            let options = WriteOptions::new().disable_seeking(true).compression(None);
            let options = options.profile(profile).library(library);
            self.writer = Some(Writer::with_options(out, options)?);
        }
        let Some(writer) = &mut self.writer else { return Ok(()) };
        match record {
            Record::Schema { header, data } => {
                writer.add_schema_with_id(header.id, &header.name, &header.encoding, &data)?;
            }
            Record::Channel(channel) => {
                let mcap::records::Channel { id, schema_id, topic, message_encoding, metadata } = channel;
                writer.add_channel_with_id(id, schema_id, &topic, &message_encoding, &metadata)?;
            }
            Record::Message { header, data } => {
                writer.write_to_known_channel(&header, &data)?;
                self.repaired.messages += 1;
                self.repaired.bytes += data.len() as u64;
            }
            Record::Attachment { header, data, .. } => {
                let mcap::records::AttachmentHeader { log_time, create_time, name, media_type } = header;
                writer.attach(&Attachment { log_time, create_time, name, media_type, data })?;
                self.repaired.attachments += 1;
            }
            Record::Metadata(metadata) => {
                writer.write_metadata(&metadata)?;
                self.repaired.metadata += 1;
            }
            Record::Unknown { opcode, data } if opcode >= 0x80 => {
                writer.write_private_record(opcode, &data, Default::default())?;
            }
            // Indices and statistics are made anew.
            _ => {}
        }
        Ok(())
    }

    fn finish(self) -> Result<Repaired, CopyError> {
        let Some(mut writer) = self.writer else { return Ok(self.repaired) };
        writer.finish().map_err(|error| CopyError::Write(plain(error)))?;
        Ok(self.repaired)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::writer::McapWriter;
    use crate::{About, Decoded, Side, StreamKind};

    #[test]
    fn what_other_programs_wrote_is_kept_and_nothing_is_added() {
        let mut writer = WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
        let schema = writer.add_schema("ros.Image", "ros2msg", b"uint8[] data").unwrap();
        let camera = writer.add_channel(schema, "/camera", "cdr", &Default::default()).unwrap();
        let header =
            mcap::records::MessageHeader { channel_id: camera, sequence: 7, log_time: 1, publish_time: 2 };
        writer.write_to_known_channel(&header, b"picture").unwrap();
        let attachment = Attachment {
            log_time: 3,
            create_time: 4,
            name: "notes".into(),
            media_type: "text/plain".into(),
            data: b"wet".into(),
        };
        writer.attach(&attachment).unwrap();
        let metadata =
            mcap::records::Metadata { name: "field".into(), metadata: [("row".into(), "7".into())].into() };
        writer.write_metadata(&metadata).unwrap();
        writer.flush().unwrap();
        let torn = writer.into_inner().into_inner();
        let mut out = Cursor::new(Vec::new());
        let repaired = repair(&mut &torn[..], torn.len() as u64, &mut out).unwrap();
        assert_eq!((repaired.messages, repaired.attachments, repaired.metadata), (1, 1, 1));
        let summary = mcap::Summary::read(out.get_ref()).unwrap().expect("an index");
        assert_eq!((summary.attachment_indexes.len(), summary.metadata_indexes.len()), (1, 1));
        let message = mcap::MessageStream::new(out.get_ref()).unwrap().next().unwrap().unwrap();
        assert_eq!(
            (message.channel.topic.as_str(), &message.data[..], message.sequence),
            ("/camera", &b"picture"[..], 7)
        );
        assert_eq!(message.channel.schema.as_ref().unwrap().name, "ros.Image");
    }

    #[test]
    fn raw_bytes_stay_raw() {
        let none = Decoded::default();
        let mut writer = McapWriter::new(Cursor::new(Vec::new()), &About::default(), none).unwrap();
        let stream = writer.add_stream("scanner", StreamKind::Cola).unwrap();
        for at_ns in 0..50 {
            writer.write(stream, Side::Device, at_ns, 0, b"\x02sRA LMDscandata \x03").unwrap();
        }
        writer.flush().unwrap();
        let mut file = writer.into_inner().into_inner();
        file.truncate(file.len() - 3);
        let mut out = Cursor::new(Vec::new());
        let repaired = repair(&mut &file[..], file.len() as u64, &mut out).unwrap();
        assert_eq!((repaired.messages, repaired.torn.is_some()), (49, true));
        assert_eq!(mcap::Summary::read(out.get_ref()).unwrap().expect("an index").channels.len(), 2);
        // A whole file stays whole.
        let again = repair(&mut &out.get_ref()[..], out.get_ref().len() as u64, &mut Cursor::new(Vec::new()))
            .unwrap();
        assert_eq!((again.messages, again.torn), (49, None));
    }

    #[test]
    fn what_stands_behind_a_hole_is_kept() {
        let mut writer =
            McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).unwrap();
        let stream = writer.add_stream("scanner", StreamKind::Cola).unwrap();
        for at_ns in 0..50 {
            writer.write(stream, Side::Device, at_ns, 0, b"\x02sRA LMDscandata \x03").unwrap();
        }
        writer.finish().unwrap();
        let mut file = writer.into_inner().into_inner();
        let middle = file.windows(11).rposition(|bytes| bytes == b"LMDscandata").unwrap() / 2;
        file[middle..middle + 400].fill(0);
        let mut out = Cursor::new(Vec::new());
        let repaired = repair(&mut &file[..], file.len() as u64, &mut out).unwrap();
        let torn = repaired.torn.expect("it is told");
        assert!(repaired.messages > 35 && torn.resumed.is_some_and(|resumed| resumed.holes == 1), "{torn}");
        let again = repair(&mut &out.get_ref()[..], out.get_ref().len() as u64, &mut Cursor::new(Vec::new()))
            .unwrap();
        assert_eq!((again.messages, again.torn), (repaired.messages, None));
    }
}
