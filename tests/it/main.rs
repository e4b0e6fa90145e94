//! The end-to-end tests of the whole program in one binary, one module a subject. A test that watches its whole process
//! (allocations, memory) has a binary of its own beside this folder.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

mod common;

mod air_and_stand;
mod any_bytes;
mod bad_input;
mod before_drive;
mod bench_library;
mod blindness;
mod bridges;
mod calibrations;
mod captures;
mod check;
mod check_page;
mod child_time;
mod class_studies;
mod client_limits;
mod control;
mod csv;
mod decode;
mod determinism;
mod documents;
mod emulated_device;
mod endings;
mod estimate_recordings;
mod estimate_sources;
mod examples;
#[cfg(feature = "tables")]
mod exports;
mod fault_table;
mod faults;
mod features;
mod field;
mod frozen_clock;
mod help;
mod hostile;
mod idle_faults;
mod interrupted;
mod interrupted_reading;
mod isobus;
mod kept_rows;
mod links;
#[cfg(feature = "manual")]
mod manual_pages;
mod maps;
mod mount_pose;
mod mrs1000;
mod multiscan;
mod nmea;
mod nozzles;
mod online_offline;
mod optics;
mod orchards;
mod other_beams;
mod other_side;
mod other_way;
mod outputs;
mod overwriting;
mod part_faults;
mod picoscan;
mod picoscan_check;
mod picoscan_driver;
mod picoscan_replay;
mod profiles;
mod proxy;
mod pty;
mod reconnected;
mod record;
mod record_lms2xx;
mod recorded_echo;
mod recorded_settings;
mod recordings;
mod reference;
mod replay;
mod replay_lines;
mod replayed_faults;
mod replayed_polls;
mod replayed_requests;
mod replayed_settings;
mod roofs;
#[cfg(feature = "tables")]
mod scans;
mod searches;
mod serial_lines;
mod services;
mod several_scanners;
mod silent_scanner;
mod slopes;
mod socketcan;
mod sprayer;
mod sprayer_score;
mod standard_input;
mod streams;
mod studies;
mod study_parts;
mod survey;
mod sweeps;
mod timeless_copies;
mod timeless_replays;
mod timeline;
mod together;
mod tractor;
mod tractor_faults;
mod transcripts;
mod truth_files;
mod validity;
mod watched_tape;
mod web;
mod web_lms2xx;
mod windows;
