#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "base/error.h"
#include "link/protocol.h"
#include "link/worker.h"

namespace clarus::link {
namespace {

constexpr int kSettleMilliseconds = 1000;  // that what was begun may take to end
constexpr size_t kMostHeader = 4096;       // longer than any message's; the rest of such a one is not looked at

void check(ucs_status_t status, const char* what) {
    if (status != UCS_OK) fail(ErrorKind::file, "{}: UCX says: {}", what, ucs_status_string(status));
}

using Clock = std::chrono::steady_clock;

}  // namespace

struct Worker::Requested {
    Worker* worker;
    std::function<void(bool)> done;
    std::vector<std::byte> header;
};

Worker::Worker(const std::string& device) {
    ucp_config_t* config = nullptr;
    check(ucp_config_read(nullptr, nullptr, &config), "cannot read UCX's settings");
    if (!device.empty() && !std::getenv("UCX_NET_DEVICES")) ucp_config_modify(config, "NET_DEVICES", device.c_str());
    ucp_params_t parameters{};
    parameters.field_mask = UCP_PARAM_FIELD_FEATURES;
    parameters.features = UCP_FEATURE_AM | UCP_FEATURE_WAKEUP;
    const ucs_status_t status = ucp_init(&parameters, config, &context_);
    ucp_config_release(config);
    check(status, "cannot start UCX");

    ucp_worker_params_t worker{};
    worker.field_mask = UCP_WORKER_PARAM_FIELD_THREAD_MODE;
    worker.thread_mode = UCS_THREAD_MODE_SINGLE;
    ucp_am_handler_param_t handler{};
    handler.field_mask = UCP_AM_HANDLER_PARAM_FIELD_ID | UCP_AM_HANDLER_PARAM_FIELD_CB | UCP_AM_HANDLER_PARAM_FIELD_ARG;
    handler.id = kActiveMessage;
    handler.arg = this;
    handler.cb = [](void* self, const void* header, size_t header_bytes, void* data, size_t bytes,
                    const ucp_am_recv_param_t* received) {
        if (!(received->recv_attr & UCP_AM_RECV_ATTR_FIELD_REPLY_EP)) return UCS_OK;  // whoever that was
        Message message{received->reply_ep, {}};
        const auto* begin = static_cast<const std::byte*>(header);
        message.header.assign(begin, begin + std::min(header_bytes, kMostHeader));
        const bool is_fetched = received->recv_attr & UCP_AM_RECV_ATTR_FLAG_RNDV;
        if (is_fetched) {
            message.data = data;
            message.data_bytes = bytes;
        }
        static_cast<Worker*>(self)->messages.push_back(std::move(message));
        return is_fetched ? UCS_INPROGRESS : UCS_OK;
    };
    try {
        check(ucp_worker_create(context_, &worker, &worker_), "cannot start UCX");
        check(ucp_worker_set_am_recv_handler(worker_, &handler), "cannot start UCX");
        check(ucp_worker_get_efd(worker_, &events_), "UCX cannot wait for events");
    } catch (...) {
        if (worker_) ucp_worker_destroy(worker_);
        ucp_cleanup(context_);
        throw;
    }
}

Worker::~Worker() {
    if (listener_) ucp_listener_destroy(listener_);
    settle(kSettleMilliseconds, [&] { return under_way_ == 0; });
    ucp_worker_destroy(worker_);
    ucp_cleanup(context_);
}

void Worker::listen(const Address& at) {
    const SocketAddress address = resolve(at);
    ucp_listener_params_t parameters{};
    parameters.field_mask = UCP_LISTENER_PARAM_FIELD_SOCK_ADDR | UCP_LISTENER_PARAM_FIELD_CONN_HANDLER;
    parameters.sockaddr = {address.get(), address.size};
    parameters.conn_handler.arg = this;
    parameters.conn_handler.cb = [](ucp_conn_request_h request, void* self) {
        static_cast<Worker*>(self)->requests.push_back(request);
    };
    const ucs_status_t status = ucp_listener_create(worker_, &parameters, &listener_);
    if (status == UCS_OK) return;
    listener_ = nullptr;
    fail(ErrorKind::file, "cannot listen at {}: {}", at.text(),
         status == UCS_ERR_BUSY       ? "another process does"
         : status == UCS_ERR_IO_ERROR ? "is it an address of this machine?"
                                      : ucs_status_string(status));
}

bool Worker::progress() {
    bool any = false;
    for (int i = 0; i < 1000 && ucp_worker_progress(worker_); ++i) any = true;
    return any;
}

void Worker::wait(const std::vector<int>& descriptors, int milliseconds) {
    if (progress() || ucp_worker_arm(worker_) != UCS_OK) return;  // busy: there is more
    std::vector<pollfd> events{{events_, POLLIN, 0}};
    for (const int descriptor : descriptors) events.push_back({descriptor, POLLIN, 0});
    poll(events.data(), events.size(), milliseconds);
}

void Worker::settle(int milliseconds, const std::function<bool()>& settled) {
    const auto until = Clock::now() + std::chrono::milliseconds(milliseconds);
    while (!settled() && Clock::now() < until) wait({}, 10);
}

void Worker::finished(Requested* requested, ucs_status_t status) {
    const std::unique_ptr<Requested> owned(requested);
    --owned->worker->under_way_;
    if (owned->done) owned->done(status == UCS_OK);
}

/// What is asked for is either done at once, or told by a callback.
void Worker::request(ucs_status_ptr_t request, std::unique_ptr<Requested> requested) {
    ++under_way_;
    if (UCS_PTR_IS_PTR(request)) return void(requested.release());  // `finished` has it
    finished(requested.release(), UCS_PTR_STATUS(request));
}

void Worker::fetch(const Message& message, void* to, std::function<void(bool)> done) {
    auto requested = std::make_unique<Requested>(Requested{this, std::move(done), {}});
    ucp_request_param_t parameters{};
    parameters.op_attr_mask = UCP_OP_ATTR_FIELD_CALLBACK | UCP_OP_ATTR_FIELD_USER_DATA | UCP_OP_ATTR_FLAG_NO_IMM_CMPL;
    parameters.cb.recv_am = [](void* request, ucs_status_t status, size_t, void* user) {
        ucp_request_free(request);
        finished(static_cast<Requested*>(user), status);
    };
    parameters.user_data = requested.get();
    request(ucp_am_recv_data_nbx(worker_, message.data, to, message.data_bytes, &parameters), std::move(requested));
}

void Worker::drop(const Message& message) {
    if (message.data) ucp_am_data_release(worker_, message.data);
}

Endpoint::Endpoint(Worker& worker, const SocketAddress& to) : worker_(worker) {
    ucp_ep_params_t parameters{};
    parameters.field_mask = UCP_EP_PARAM_FIELD_FLAGS | UCP_EP_PARAM_FIELD_SOCK_ADDR;
    parameters.flags = UCP_EP_PARAMS_FLAGS_CLIENT_SERVER;
    parameters.sockaddr = {to.get(), to.size};
    create(parameters);
}

Endpoint::Endpoint(Worker& worker, ucp_conn_request_h request) : worker_(worker) {
    ucp_ep_params_t parameters{};
    parameters.field_mask = UCP_EP_PARAM_FIELD_CONN_REQUEST;
    parameters.conn_request = request;
    create(parameters);
}

void Endpoint::create(ucp_ep_params_t& parameters) {
    parameters.field_mask |= UCP_EP_PARAM_FIELD_ERR_HANDLER | UCP_EP_PARAM_FIELD_ERR_HANDLING_MODE;
    parameters.err_mode = UCP_ERR_HANDLING_MODE_PEER;
    parameters.err_handler.arg = state_.get();
    parameters.err_handler.cb = [](void* arg, ucp_ep_h, ucs_status_t status) {
        auto* state = static_cast<State*>(arg);
        state->is_broken = true;
        state->why = ucs_status_string(status);
    };
    check(ucp_ep_create(worker_.worker_, &parameters, &endpoint_), "cannot connect");
}

Endpoint::~Endpoint() {
    ucp_request_param_t parameters{};
    parameters.op_attr_mask = UCP_OP_ATTR_FIELD_FLAGS;
    parameters.flags = UCP_EP_CLOSE_FLAG_FORCE;
    const ucs_status_ptr_t closing = ucp_ep_close_nbx(endpoint_, &parameters);
    if (UCS_PTR_IS_PTR(closing)) {
        worker_.settle(kSettleMilliseconds, [&] { return ucp_request_check_status(closing) != UCS_INPROGRESS; });
        ucp_request_free(closing);
    }
    worker_.settle(kSettleMilliseconds, [&] { return state_->under_way == 0; });
}

void Endpoint::send(const void* header, size_t header_bytes, const void* data, size_t bytes,
                    std::function<void(bool)> done) {
    if (is_broken()) {
        if (done) done(false);
        return;
    }
    const auto* begin = static_cast<const std::byte*>(header);
    ++state_->under_way;
    auto requested =
        std::make_unique<Worker::Requested>(Worker::Requested{&worker_,
                                                              [state = state_, told = std::move(done)](bool sent) {
                                                                  --state->under_way;
                                                                  if (told) told(sent);
                                                              },
                                                              {begin, begin + header_bytes}});
    ucp_request_param_t parameters{};
    parameters.op_attr_mask = UCP_OP_ATTR_FIELD_CALLBACK | UCP_OP_ATTR_FIELD_USER_DATA | UCP_OP_ATTR_FIELD_FLAGS;
    parameters.flags = UCP_AM_SEND_FLAG_REPLY | (data ? UCP_AM_SEND_FLAG_RNDV : UCP_AM_SEND_FLAG_EAGER);
    parameters.cb.send = [](void* request, ucs_status_t status, void* user) {
        ucp_request_free(request);
        Worker::finished(static_cast<Worker::Requested*>(user), status);
    };
    parameters.user_data = requested.get();
    const auto& kept = requested->header;
    worker_.request(ucp_am_send_nbx(endpoint_, kActiveMessage, kept.data(), kept.size(), data, bytes, &parameters),
                    std::move(requested));
}

void Endpoint::flush(int milliseconds) {
    worker_.settle(milliseconds, [&] { return is_broken() || state_->under_way == 0; });
}

}  // namespace clarus::link
