// MRPT's own drivers, unmodified: connect, start up as they do, and print what they receive.
//
// scans CLASS HOST PORT COUNT: one line a scan, its aperture in degrees and then every range in millimetres.

#include <mrpt/hwdrivers/CLMS100eth.h>
#include <mrpt/hwdrivers/CSICKTim561Eth_2050101.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "receive.hpp"

template <class Driver>
int receive(const std::string& host, unsigned int port, int count) {
    Driver driver(host, port);
    if (!driver.turnOn()) {
        std::fprintf(stderr, "turnOn failed\n");
        return 1;
    }
    return print_scans(driver, count, 40 * count, std::chrono::milliseconds(20)) ? 0 : 1;
}

int main(int argc, char** argv) {
    if (argc != 5) {
        std::fprintf(stderr, "usage: scans CLMS100Eth|CSICKTim561Eth HOST PORT COUNT\n");
        return 2;
    }
    const std::string driver = argv[1];
    const unsigned int port = std::strtoul(argv[3], nullptr, 10);
    const int count = std::atoi(argv[4]);
    if (driver == "CLMS100Eth") {
        return receive<mrpt::hwdrivers::CLMS100Eth>(argv[2], port, count);
    }
    if (driver == "CSICKTim561Eth") {
        return receive<mrpt::hwdrivers::CSICKTim561Eth>(argv[2], port, count);
    }
    std::fprintf(stderr, "no driver %s\n", argv[1]);
    return 2;
}
