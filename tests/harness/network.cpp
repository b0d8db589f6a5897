#include "network.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "share/endpoint.h"

namespace clarus::test {
namespace {

constexpr int kMtu = 9000;

sockaddr make_address(const std::string& text) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    inet_pton(AF_INET, text.c_str(), &address.sin_addr);
    sockaddr result;
    std::memcpy(&result, &address, sizeof result);
    return result;
}

bool set_up(const char* device, const char* address, int mtu) {
    const int control = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ifreq request{};
    std::strncpy(request.ifr_name, device, IFNAMSIZ - 1);
    bool ok = control >= 0;
    if (address) {
        request.ifr_addr = make_address(address);
        ok = ok && ioctl(control, SIOCSIFADDR, &request) == 0;
        request.ifr_addr = make_address("255.255.255.0");
        ok = ok && ioctl(control, SIOCSIFNETMASK, &request) == 0;
        request.ifr_mtu = mtu;
        ok = ok && ioctl(control, SIOCSIFMTU, &request) == 0;
    }
    request.ifr_flags = IFF_UP | IFF_RUNNING;
    ok = ok && ioctl(control, SIOCSIFFLAGS, &request) == 0;
    close(control);
    return ok;
}

/// A process in namespaces of its own, which sends its end of the cable and waits. The exit code says what failed.
int be_machine(int number, int connection) {
    // Programs look for network devices in /sys, which shows those of who mounted it.
    if (unshare(CLONE_NEWNET | CLONE_NEWNS) != 0) return 1;
    if (mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return 2;
    if (mount("sysfs", "/sys", "sysfs", 0, nullptr) != 0) return 3;
    const int tunnel = open("/dev/net/tun", O_RDWR | O_CLOEXEC | O_NONBLOCK);
    ifreq request{};
    std::strncpy(request.ifr_name, "cable", IFNAMSIZ - 1);
    request.ifr_flags = IFF_TUN | IFF_NO_PI;
    if (tunnel < 0 || ioctl(tunnel, TUNSETIFF, &request) != 0) return 4;
    if (!set_up("lo", nullptr, 0) || !set_up("cable", Network::address(number).c_str(), kMtu)) return 5;
    const char word = 'c';
    if (share_send(connection, &word, 1, &tunnel, 1) != 0) return 6;
    for (;;) pause();
}

}  // namespace

std::string free_port() {
    const int probe = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    REQUIRE(bind(probe, reinterpret_cast<const sockaddr*>(&address), size) == 0);
    REQUIRE(getsockname(probe, reinterpret_cast<sockaddr*>(&address), &size) == 0);
    close(probe);
    return std::to_string(ntohs(address.sin_port));
}

std::string Network::address(int machine) { return machine == 0 ? "10.77.0.1" : "10.77.0.2"; }

std::unique_ptr<Network> Network::make(std::string& why) {
    if (geteuid() != 0 || access("/dev/net/tun", R_OK | W_OK) != 0) {
        why = "network namespaces need an administrator's rights, and /dev/net/tun";
        return nullptr;
    }
    std::unique_ptr<Network> network(new Network);
    for (int number = 0; number < 2; ++number) {
        int sockets[2];
        REQUIRE(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets) == 0);
        network->machines_.push_back(std::make_unique<ChildProcess>([&] { return be_machine(number, sockets[1]); }));
        close(sockets[1]);
        pollfd event{sockets[0], POLLIN, 0};
        poll(&event, 1, 10000);
        char word = 0;
        int count = 0;
        const bool has_end = share_receive(sockets[0], &word, 1, &network->ends_[number], 1, &count) == 1 && count == 1;
        close(sockets[0]);
        if (has_end) continue;
        why = "no network namespace can be made here: step " + std::to_string(network->machines_.back()->result());
        return nullptr;
    }
    network->cable_ = std::thread([network = network.get()] { network->carry(); });
    return network;
}

Network::~Network() {
    stop_ = true;
    if (cable_.joinable()) cable_.join();
    for (const int end : ends_)
        if (end >= 0) close(end);
}

std::vector<std::string> Network::on(int machine) const {
    const std::string folder = "/proc/" + std::to_string(machines_[machine]->id()) + "/ns/";
    return {"/usr/bin/nsenter", "--net=" + folder + "net", "--mount=" + folder + "mnt", "--"};
}

void Network::carry() {
    std::vector<char> packet(kMtu);
    while (!stop_) {
        const auto now = std::chrono::steady_clock::now();
        pollfd events[2] = {{ends_[0], POLLIN, 0}, {ends_[1], POLLIN, 0}};
        poll(events, 2, 1);
        for (int from = 0; from < 2; ++from) {
            for (ssize_t bytes; (bytes = read(ends_[from], packet.data(), packet.size())) > 0;)
                if (!is_cut_)
                    under_way_[1 - from].push_back({now + delay_.load(), {packet.begin(), packet.begin() + bytes}});
        }
        for (int to = 0; to < 2; ++to) {
            std::deque<Packet>& packets = under_way_[to];
            for (; !packets.empty() && packets.front().due <= std::chrono::steady_clock::now(); packets.pop_front())
                if (!is_cut_ && write(ends_[to], packets.front().bytes.data(), packets.front().bytes.size()) < 0)
                    continue;  // lost, as on a cable
        }
    }
}

}  // namespace clarus::test
