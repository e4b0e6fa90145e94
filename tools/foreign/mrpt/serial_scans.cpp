// MRPT's own serial driver, unmodified: opens the port, starts the scanner up as it does, and prints what it receives.
//
// serial_scans PORT RATE COUNT: one line a scan, its aperture in degrees and then every range in millimetres.

#include <mrpt/hwdrivers/CSickLaserSerial.h>
#include <mrpt/obs/CObservation2DRangeScan.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <thread>

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
    int received = 0;
    try {
        if (!driver.turnOn()) {
            std::fprintf(stderr, "turnOn failed\n");
            return 1;
        }
        for (int attempt = 0; received < count && attempt < 1000 * count; ++attempt) {
            bool there = false;
            bool error = false;
            mrpt::obs::CObservation2DRangeScan scan;
            driver.doProcessSimple(there, scan, error);
            if (error || !there) {
                std::this_thread::sleep_for(std::chrono::milliseconds(2));
                continue;
            }
            std::printf("SCAN %.4f", scan.aperture * 180.0 / M_PI);
            for (size_t beam = 0; beam < scan.getScanSize(); ++beam) {
                std::printf(" %ld", std::lround(1000.0 * scan.getScanRange(beam)));
            }
            std::printf("\n");
            std::fflush(stdout);
            ++received;
        }
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return received == count ? 0 : 1;
}
