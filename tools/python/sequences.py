"""Start-up sequences as captured from running clients: command, and the reply it waits for.

A reply is bytes where the listing gives them for an LMS111, else a regular expression for its form.
"""

import re


def form(pattern):
    """A reply known by its form only."""
    return re.compile(pattern, re.DOTALL)


#: libLMS1xx's test program; then it waits for STlms 7 and subscribes.
LIBLMS1XX = [
    (b"sMN SetAccessMode 03 F4724744", b"sAN SetAccessMode 1"),
    (b"sMN LMCstopmeas", b"sAN LMCstopmeas 0"),
    (b"sRN LMPscancfg", b"sRA LMPscancfg 1388 1 1388 FFF92230 225510"),
    (b"sMN mLMPsetscancfg 1388 +1 1388 FFF92230 225510", b"sAN mLMPsetscancfg 0 1388 1 1388 FFF92230 225510"),
    (b"sWN LMDscandatacfg 01 00 1 1 0 00 00 0 0 0 0 +1", b"sWA LMDscandatacfg"),
    (b"sMN LMCstartmeas", b"sAN LMCstartmeas 0"),
]

#: MRPT CLMS100Eth: decimal numbers with a sign; then it waits for STlms 7 and polls.
MRPT = [
    (b"sMN SetAccessMode 03 F4724744", b"sAN SetAccessMode 1"),
    (b"sMN mLMPsetscancfg +2500 +1 +2500 -450000 +2250000",
     b"sAN mLMPsetscancfg 0 9C4 1 9C4 FFF92230 225510"),
    (b"sWN LMDscandatacfg 01 00 0 1 0 00 00 0 0 0 0 +1", b"sWA LMDscandatacfg"),
    (b"sMN LMCstartmeas", b"sAN LMCstartmeas 0"),
]

#: sick_scan_xd's launch file sick_lms_1xx, as text; then it waits for SCdevicestate 1 and subscribes.
SICK_SCAN_XD_A = [
    (b"sRN SCdevicestate", form(rb"sRA SCdevicestate [0-3]")),
    (b"sMN SetAccessMode 03 F4724744", b"sAN SetAccessMode 1"),
    (b"sWN EIHstCola 0", b"sWA EIHstCola"),
    (b"sRN FirmwareVersion", b"sRA FirmwareVersion 9 V1.80.2  "),
    (b"sRN SCdevicestate", form(rb"sRA SCdevicestate [0-3]")),
    (b"sRN ODoprh", form(rb"sRA ODoprh [0-9A-F]+")),
    (b"sRN ODpwrc", form(rb"sRA ODpwrc [0-9A-F]+")),
    (b"sRN LocationName", form(rb"sRA LocationName [0-9A-F]+ .*")),
    (b"sRN LMPoutputRange", b"sRA LMPoutputRange 1 1388 FFF92230 225510"),
    (b"sWN LMPoutputRange 1 1388 FFF92233 22550D", b"sWA LMPoutputRange"),
    (b"sRN LMPoutputRange", b"sRA LMPoutputRange 1 1388 FFF92233 22550D"),
    *[(b"sRN field%03d" % slot, form(rb"sRA field%03d .+|sFA [0-9A-F]+" % slot)) for slot in range(30)],
    (b"sRN LIDinputstate", form(rb"sRA LIDinputstate .+")),
    (b"sWN LMDscandatacfg 01 00 0 0 0 00 00 0 0 0 1 +1", b"sWA LMDscandatacfg"),
    (b"sRN LMDscandatacfg", b"sRA LMDscandatacfg 1 0 0 0 0 0 0 0 0 0 1 1"),
    # It really sends these backslashes; a real device answers sFA, and it goes on.
    (rb"sMN mLMPsetscancfg \x00\x00\x13\x88\x00\x01\x00\x00\x13\x88\xFF\xF9\x22\x30\x00\x22\x55\x10",
     form(rb"sFA [0-9A-F]+")),
    (b"sRN LMPscancfg", b"sRA LMPscancfg 1388 1 1388 FFF92230 225510"),
    (b"sEN LFErec 1", b"sEA LFErec 1"),
    (b"sEN LIDoutputstate 1", b"sEA LIDoutputstate 1"),
    (b"sEN LIDinputstate 1", b"sEA LIDinputstate 1"),
    (b"sMN LMCstartmeas", b"sAN LMCstartmeas 0"),
    (b"sMN Run", b"sAN Run 1"),
]

_SCAN_AREA = bytes.fromhex("00001388 0001 00001388 FFF92230 00225510")
_AS_DELIVERED = bytes.fromhex("0001 00001388 FFF92230 00225510")
_OUTPUT_RANGE = bytes.fromhex("0001 00001388 FFF92233 0022550D")
_SCANDATACFG = bytes.fromhex("01 00 00 00 00 00 00 00 00 00 01 00 01")

#: The same in binary.
SICK_SCAN_XD_B = [
    (b"sRN SCdevicestate", form(rb"sRA SCdevicestate [\x00-\x03]")),
    (b"sMN SetAccessMode \x03\xf4\x72\x47\x44", b"sAN SetAccessMode \x01"),
    (b"sWN EIHstCola \x01", b"sWA EIHstCola "),
    (b"sRN FirmwareVersion", b"sRA FirmwareVersion \x00\x09V1.80.2  "),
    (b"sRN SCdevicestate", form(rb"sRA SCdevicestate [\x00-\x03]")),
    (b"sRN ODoprh", form(rb"sRA ODoprh .{4}")),
    (b"sRN ODpwrc", form(rb"sRA ODpwrc .{4}")),
    (b"sRN LocationName", form(rb"sRA LocationName \x00.+")),
    (b"sRN LMPoutputRange", b"sRA LMPoutputRange " + _AS_DELIVERED),
    (b"sWN LMPoutputRange " + _OUTPUT_RANGE, b"sWA LMPoutputRange "),
    (b"sRN LMPoutputRange", b"sRA LMPoutputRange " + _OUTPUT_RANGE),
    *[(b"sRN field%03d" % slot, form(rb"sRA field%03d .+|sFA\x00." % slot)) for slot in range(30)],
    (b"sRN LIDinputstate", form(rb"sRA LIDinputstate .{12}")),
    (b"sWN LMDscandatacfg " + _SCANDATACFG, b"sWA LMDscandatacfg "),
    (b"sRN LMDscandatacfg", b"sRA LMDscandatacfg " + _SCANDATACFG),
    (b"sMN mLMPsetscancfg " + _SCAN_AREA, b"sAN mLMPsetscancfg \x00" + _SCAN_AREA),
    (b"sRN LMPscancfg", b"sRA LMPscancfg " + _SCAN_AREA),
    (b"sEN LFErec \x01", b"sEA LFErec \x01"),
    (b"sEN LIDoutputstate \x01", b"sEA LIDoutputstate \x01"),
    (b"sEN LIDinputstate \x01", b"sEA LIDinputstate \x01"),
    (b"sMN LMCstartmeas", b"sAN LMCstartmeas \x00"),
    (b"sMN Run", b"sAN Run \x01"),
]


def play(client, sequence):
    """Sends each command and compares its reply."""
    for command, expected in sequence:
        reply = client.exchange(command)
        if isinstance(expected, bytes):
            assert reply == expected, "%r was answered by %r" % (command, reply)
        else:
            assert expected.fullmatch(reply), "%r was answered by %r" % (command, reply)
