// A sprayer's controller in C++, as an example: nothing but the standard library and Linux' sockets. Built with: g++ -O2 -std=c++17 -o spray spray.cpp
//
// usage: spray SCANNER CAN
//
// SCANNER is HOST:PORT of the scanner (CoLa B), CAN that of a socketcand server, or the name of a CAN interface such as vcan0. It does what spray.py beside this file does: each
// scan is kept with the way driven when it was made, and a section is told to open when its nozzles will be at leaves by the time that flow begins. Time is that of scans and of
// CAN frames; at a CAN interface, where frames have none, it is that of scans alone.

#include <arpa/inet.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <array>
#include <cmath>
#include <cstring>
#include <deque>
#include <string>

constexpr int SECTIONS = 4, LEAST_BEAMS = 5;
constexpr double BANDS_M[SECTIONS][2] = {{0.5, 1.0}, {1.0, 1.5}, {1.5, 2.0}, {2.0, 2.5}};
constexpr double SCANNER_HEIGHT_M = 1.6, NOZZLE_BEHIND_M = 1.0, NEAR_M = 0.5, FAR_M = 2.9, STANDSTILL_M_S = 0.1, KEPT_M = 8;
// From what the scanner sees to what the valves do, seconds: computing, dead times of the valves, one turn of the mirror.
constexpr double COMPUTE_S = 0.02, VALVE_ON_S = 0.15, VALVE_OFF_S = 0.10, TURN_S = 0.02;
constexpr double PERIOD_S = 0.05, SILENT_S = 0.3, LONGEST_GAP_S = 2;
constexpr uint32_t SECTION_DUTY = 0xFF14, GROUND_SPEED = 0xFE49, ADDRESS_CLAIMED = 0xEEFF, ADDRESS = 0x27;

using Sections = std::array<bool, SECTIONS>;
[[noreturn]] void fail(const std::string &why) { std::fprintf(stderr, "%s\n", why.c_str()), std::exit(1); }

int dial(const std::string &place) {
    const size_t colon = place.rfind(':');
    sockaddr_in address{AF_INET, htons(static_cast<uint16_t>(std::atoi(place.c_str() + colon + 1))), {}, {}};
    if (inet_pton(AF_INET, place.substr(0, colon).c_str(), &address.sin_addr) != 1) fail("expected an IPv4 address and a port, found " + place);
    const int stream = socket(AF_INET, SOCK_STREAM, 0), on = 1;
    if (connect(stream, reinterpret_cast<sockaddr *>(&address), sizeof address) != 0) fail("nobody is at " + place);
    setsockopt(stream, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    return stream;
}

void write_all(int stream, const std::string &bytes) {
    for (size_t at = 0; at < bytes.size();) {
        const ssize_t n = write(stream, bytes.data() + at, bytes.size() - at);
        n > 0 ? void(at += n) : fail("a connection is gone");
    }
}

// Big-endian numbers of the scanner.
uint32_t number(const std::string &bytes, size_t at, int width) {
    uint32_t value = 0;
    while (width-- > 0) value = value << 8 | static_cast<uint8_t>(bytes.at(at++));
    return value;
}

float real(const std::string &bytes, size_t at) {
    const union { uint32_t bits; float value; } both = {number(bytes, at, 4)};
    return both.value;
}

struct Can {
    int stream;
    bool is_interface;
    std::string rest;
    explicit Can(const std::string &place) : is_interface(place.find(':') == std::string::npos) {
        if (!is_interface) {
            stream = dial(place), write_all(stream, "< open can0 >< rawmode >");
            return;
        }
        stream = socket(PF_CAN, SOCK_RAW, CAN_RAW);
        ifreq request{};
        std::snprintf(request.ifr_name, sizeof request.ifr_name, "%s", place.c_str());
        if (stream < 0 || ioctl(stream, SIOCGIFINDEX, &request) != 0) fail("no CAN interface " + place);
        sockaddr_can address{AF_CAN, request.ifr_ifindex, {}};
        if (bind(stream, reinterpret_cast<sockaddr *>(&address), sizeof address) != 0) fail("cannot open " + place);
    }

    void send(uint32_t group, const uint8_t *data) {
        const uint32_t id = 0x18u << 24 | group << 8 | ADDRESS;
        if (is_interface) {
            can_frame frame{};
            frame.can_id = id | CAN_EFF_FLAG;
            frame.can_dlc = 8;
            std::memcpy(frame.data, data, 8);
            if (write(stream, &frame, sizeof frame) != sizeof frame) fail("the CAN interface is gone");
            return;
        }
        char text[64];
        int n = std::snprintf(text, sizeof text, "< send %08X 8", id);
        for (int i = 0; i < 8; i++) n += std::snprintf(text + n, sizeof text - n, " %02X", data[i]);
        write_all(stream, std::string(text) + " >");
    }

    // Calls `on` with time (below 0: unknown), group and the first two bytes of each frame that has come.
    template <class On> void receive(On on) {
        char bytes[4096];
        const ssize_t n = read(stream, bytes, sizeof bytes);
        if (n <= 0) std::exit(0);
        can_frame frame;
        std::memcpy(&frame, bytes, sizeof frame);
        if (is_interface) return on(-1.0, frame.can_id >> 8 & 0x3FFFF, frame.data[0] | frame.data[1] << 8);
        rest.append(bytes, n);
        for (size_t end; (end = rest.find('>')) != std::string::npos; rest.erase(0, end + 1)) {
            unsigned id, low, high;
            double at_s;
            if (std::sscanf(rest.c_str(), " < frame %x %lf %2x%2x", &id, &at_s, &low, &high) == 4) on(at_s, id >> 8 & 0x3FFFF, static_cast<int>(low | high << 8));
        }
    }
};

struct Controller {
    Can &can;
    double now_s = 0, way_m = 0, speed_m_s = 0, told_s = 0, speed_at_s = -9, scan_at_s = -9, clock_s = NAN;
    std::deque<std::pair<double, Sections>> seen;
    Sections open{};
    explicit Controller(Can &bus) : can(bus) {}

    void advance(double to_s) {
        if (to_s > now_s) way_m += speed_m_s * (to_s - now_s), now_s = to_s;
    }

    void on_frame(double at_s, uint32_t group, int value) {
        advance(at_s);
        if (group == GROUND_SPEED) speed_m_s = value <= 64255 ? value / 1000.0 : 0, speed_at_s = now_s;
        decide();
    }

    void on_scan(const std::string &scan) {
        const double time_s = number(scan, 30, 4) / 1e6;
        if (!(std::fabs(time_s + clock_s - now_s) <= LONGEST_GAP_S)) clock_s = now_s - time_s;
        advance(time_s + clock_s + TURN_S);
        scan_at_s = now_s;
        const size_t at = 54 + 6 * number(scan, 52, 2);  // encoders
        const double scale = real(scan, at + 7), offset = real(scan, at + 11);
        const double start_deg = static_cast<int32_t>(number(scan, at + 15, 4)) / 1e4, step_deg = number(scan, at + 19, 2) / 1e4;
        int beams[SECTIONS] = {};
        for (uint32_t n = 0, count = number(scan, at + 21, 2); n < count; n++) {
            const double raw = number(scan, at + 23 + 2 * n, 2), range_m = (raw * scale + offset) * 0.001, angle = (start_deg + n * step_deg - 90) * M_PI / 180;
            const double across_m = range_m * std::cos(angle), height_m = SCANNER_HEIGHT_M + range_m * std::sin(angle);
            if (raw <= 8 || across_m <= NEAR_M || across_m >= FAR_M) continue;
            for (int s = 0; s < SECTIONS; s++) beams[s] += BANDS_M[s][0] <= height_m && height_m < BANDS_M[s][1];
        }
        seen.emplace_back(way_m - speed_m_s * TURN_S / 2, Sections{});
        for (int s = 0; s < SECTIONS; s++) seen.back().second[s] = beams[s] >= LEAST_BEAMS;
        while (seen.front().first < way_m - KEPT_M) seen.pop_front();
        decide();
    }

    void decide() {
        Sections wanted{};
        const bool is_blind = now_s - scan_at_s > SILENT_S || now_s - speed_at_s > SILENT_S;
        // Open from when the nozzle will reach leaves until it will have left them. A scan stands for the way of a turn.
        const double nozzle_m = way_m - NOZZLE_BEHIND_M, half_m = speed_m_s * TURN_S / 2;
        const double from_m = nozzle_m + speed_m_s * (COMPUTE_S + VALVE_OFF_S) - half_m, to_m = nozzle_m + speed_m_s * (COMPUTE_S + VALVE_ON_S) + half_m;
        for (const auto &[where_m, canopy] : seen)
            for (int s = 0; s < SECTIONS; s++) wanted[s] |= !is_blind && speed_m_s >= STANDSTILL_M_S && canopy[s] && from_m <= where_m && where_m <= to_m;
        if (wanted == open && now_s < told_s + PERIOD_S - 1e-4) return;
        open = wanted, told_s = now_s;
        uint8_t duties[8];
        for (int s = 0; s < 8; s++) duties[s] = s < SECTIONS ? (open[s] ? 250 : 0) : 255;
        can.send(SECTION_DUTY, duties);
    }
};

int main(int count, char **words) {
    if (count != 3) fail("usage: spray SCANNER CAN");
    Can can(words[2]);
    const uint8_t name[8] = {0x01, 0x00, 0xE0, 0xFF, 0x00, 0x82, 0x00, 0x20};
    can.send(ADDRESS_CLAIMED, name);
    const int scanner = dial(words[1]);
    for (const std::string &said : {std::string("sMN SetAccessMode \x03\xf4\x72\x47\x44"), std::string("sWN FREchoFilter \0", 18), std::string("sMN Run"), std::string("sEN LMDscandata \x01")}) {
        char check = 0;
        for (const char byte : said) check ^= byte;
        write_all(scanner, std::string("\x02\x02\x02\x02\0\0\0", 7) + static_cast<char>(said.size()) + said + check);
    }
    std::puts("ready");
    std::fflush(stdout);
    Controller controller(can);
    pollfd streams[2] = {{can.stream, POLLIN, 0}, {scanner, POLLIN, 0}};
    for (std::string rest; poll(streams, 2, -1) > 0;) {
        if (streams[0].revents) can.receive([&](double at_s, uint32_t group, int value) { controller.on_frame(at_s, group, value); });
        if (!streams[1].revents) continue;
        char bytes[65536];
        const ssize_t n = read(scanner, bytes, sizeof bytes);
        n > 0 ? void(rest.append(bytes, n)) : void(streams[1].fd = -1);  // lost: its silence shuts the sections
        while (rest.size() > 8) {
            const size_t length = number(rest, 4, 4);
            if (rest.size() < 9 + length) break;
            char check = 0;
            for (size_t i = 0; i <= length; i++) check ^= rest[8 + i];
            const std::string payload = rest.substr(8, length);
            rest.erase(0, 9 + length);
            if (check == 0 && payload.rfind("sSN LMDscandata ", 0) == 0) controller.on_scan(payload);
        }
    }
}
