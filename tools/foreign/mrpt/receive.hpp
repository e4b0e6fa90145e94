// What the programs here do with a driver that is turned on: print the scans it hands out, one a line.
#pragma once

#include <mrpt/obs/CObservation2DRangeScan.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

// Prints `count` scans as `SCAN aperture_deg range_mm…`; asks at most `attempts` times, with `pause` after each in vain.
template <class Driver>
bool print_scans(Driver& driver, int count, int attempts, std::chrono::milliseconds pause) {
    int received = 0;
    for (int attempt = 0; received < count && attempt < attempts; ++attempt) {
        bool there = false;
        bool error = false;
        mrpt::obs::CObservation2DRangeScan scan;
        driver.doProcessSimple(there, scan, error);
        if (error || !there) {
            std::this_thread::sleep_for(pause);
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
    return received == count;
}
