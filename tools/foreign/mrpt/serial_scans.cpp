// MRPT's own serial driver, unmodified: opens the port, starts the scanner up as it does, and prints what it receives.
//
// serial_scans PORT RATE COUNT: one line a scan, its aperture in degrees and then every range in millimetres.

#include <mrpt/hwdrivers/CSickLaserSerial.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "receive.hpp"

int main(int argc, char** argv) {
    if (argc != 4) {
        std::fprintf(stderr, "usage: serial_scans PORT RATE COUNT\n");
        return 2;
    }
    mrpt::hwdrivers::CSickLaserSerial driver;
    driver.setSerialPort(argv[1]);
    driver.setBaudRate(std::atoi(argv[2]));
    driver.setMillimeterMode(true);
    driver.setScanFOV(180);
    driver.setScanResolution(50);
    const int count = std::atoi(argv[3]);
    try {
        if (!driver.turnOn()) {
            std::fprintf(stderr, "turnOn failed\n");
            return 1;
        }
        return print_scans(driver, count, 1000 * count, std::chrono::milliseconds(2)) ? 0 : 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
