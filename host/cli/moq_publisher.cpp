#include "cli/moq_publisher.h"

#include <array>
#include <cstdint>

#include "base/error.h"
#include "cli/stream_files.h"

namespace clarus::cli {

MoqPublisher::MoqPublisher(const std::string& url)
    : url_(url), python_(stream_files().front().text, std::array<std::string, 1>{url}) {
    const std::string answer = python_.receive_line();
    if (answer != "ready")
        fail(ErrorKind::invalid_argument, "cannot publish moq:{}: {}", url, answer.empty() ? "python3 ended" : answer);
}

void MoqPublisher::publish(std::span<const std::byte> fragment, bool is_key) {
    const std::array<uint32_t, 2> header{static_cast<uint32_t>(fragment.size()), is_key};
    if (!python_.send(header.data(), sizeof header) || !python_.send(fragment.data(), fragment.size()))
        fail(ErrorKind::file, "the stream moq:{} has ended: python3 left, what it says is above", url_);
}

}  // namespace clarus::cli
