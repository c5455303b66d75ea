#include <algorithm>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using someip::MessageType;
using someip::ReturnCode;
using enum Level;

/// A field of a response that has to be right.
auto response(void (*judge)(Trial& t, const Call& call, const SeenMessage& seen)) {
  return [judge](Trial& t) {
    const Call call = t.request();
    judge(t, call, t.answer_to(call));
  };
}

constexpr someip::MethodId unknown_method{0x7abc};

Call to_unknown_method(const Trial& t) {
  return t.call(unknown_method);
}

/// A field of an error that has to be right: of the one that an unknown method brings.
/// @param has_to_come  TC8 asks for it; the specification leaves open whether there is one
///                     [feat_req_someip_816].
auto error(void (*judge)(Trial& t, const Call& call, const SeenMessage& seen), bool has_to_come = false) {
  return [judge, has_to_come](Trial& t) {
    if (!t.profile.policy.answers_unknown_method) {
      t.unsupported(
          "the profile says that unknown methods are not answered (policy: answers_unknown_method)");
    }
    const Call call = to_unknown_method(t);
    const auto seen = t.error_answer_if_any(call);
    if (!seen && has_to_come) {
      t.missing("no answer to the request", "an error");
    }
    if (!seen) {
      t.unsupported(
          "unknown methods are not answered, which is allowed (policy: answers_unknown_method: false says "
          "so)");
    }
    judge(t, call, *seen);
  };
}

/// A request, changed, that must not be served.
auto rejected(void (*change)(Call& call)) {
  return [change](Trial& t) {
    Call call = t.request();
    change(call);
    t.not_served(call);
  };
}

/// A message that must not be answered at all.
auto silence(void (*change)(Trial& t, Call& call)) {
  return [change](Trial& t) {
    Call call = t.request();
    change(t, call);
    t.not_answered(call);
  };
}

/// The request as bytes, broken, and then that it was not served.
auto broken_bytes(void (*change)(Call& call)) {
  return [change](Trial& t) {
    Call call = t.request();
    change(call);
    t.not_served(call);
  };
}

Call getter(const Trial& t) {
  return t.call(t.profile.service().field->getter);
}
Call setter(const Trial& t, Bytes value) {
  return t.call(t.profile.service().field->setter, std::move(value));
}

/// Several requests in one datagram, each of which has to be answered.
/// @param before  what the datagram begins with.
void several_in_a_datagram(Trial& t, unsigned count, const Bytes& before = {}) {
  // Each time with other Session IDs, so that late answers to the datagram before are not counted.
  unsigned first = 0;
  unsigned next = 1;
  const auto send = [&] {
    Bytes datagram = before;
    first = next;
    for (; next < first + count; ++next) {
      Call call = t.request();
      call.client = someip::ClientId{0x5a40};
      call.session = someip::SessionId{static_cast<std::uint16_t>(next)};
      append(datagram, call.encode());
    }
    t.send_bytes(datagram);
  };
  const std::size_t since = t.now();
  const auto answers = [&] {
    return t.messages_since(since, [&](const SeenMessage& seen) {
      const unsigned session = value(seen.message.header.session);
      return seen.message.header.client == someip::ClientId{0x5a40} && session >= first && session < next;
    });
  };
  if (!t.ask(send, [&] { return answers().size() >= count; })) {
    t.missing(fmt::format("{} answers to a datagram with {} requests", answers().size(), count),
              fmt::format("{} responses", count));
  }
  t.equal("answers", std::size_t{count}, answers().size(), answers().back().packet);
}

}  // namespace

void add_rpc_cases(Cases& cases) {
  const Need call = Need::udp | Need::request;
  const Cases all{
      {.id = "rpc.response.comes",
       .title = "answers a request from the offered endpoint",
       .requirements = {"feat_req_someip_49", "feat_req_someip_141"},
       .tc8 = {"SOMEIPSRV_ONWIRE_01"},
       .needs = call,
       .run = response([](Trial& t, const Call&, const SeenMessage& seen) {
         t.equal("UDP source port", t.udp_of(t.profile.service()).port, seen.packet->from.port, seen.packet);
       })},
      {.id = "rpc.response.method-bit",
       .title = "answers with the top bit of the Method ID clear",
       .requirements = {"feat_req_someip_60"},
       .tc8 = {"SOMEIPSRV_ONWIRE_02"},
       .needs = call,
       .run = response([](Trial& t, const Call&, const SeenMessage& seen) {
         t.equal("top bit of the Method ID", 0, value(seen.message.header.method) >> 15, seen.packet);
       })},
      {.id = "rpc.response.message-id",
       .title = "answers with the Message ID of the request",
       .requirements = {"feat_req_someip_338"},
       .needs = call,
       .run = response([](Trial& t, const Call& asked, const SeenMessage& seen) {
         t.equal("Service ID", value(asked.service), value(seen.message.header.service), seen.packet);
         t.equal("Method ID", value(asked.method), value(seen.message.header.method), seen.packet);
       })},
      {.id = "rpc.response.request-id",
       .title = "answers with the Request ID of the request",
       .requirements = {"feat_req_someip_79", "feat_req_someip_338", "feat_req_someip_699"},
       .tc8 = {"SOMEIPSRV_ONWIRE_03"},
       .needs = call,
       // answer_to() compares it.
       .run =
           [](Trial& t) {
             for (const unsigned client : {0x0000U, 0x0001U, 0x8000U, 0xffffU}) {
               Call asked = t.request();
               asked.client = someip::ClientId{static_cast<std::uint16_t>(client)};
               t.answer_to(asked);
             }
           }},
      {.id = "rpc.request.id-reused",
       .title = "answers two requests in a row with one Request ID",
       .requirements = {"feat_req_someip_80"},
       .tc8 = {"SOMEIPSRV_ONWIRE_04"},
       .needs = call,
       .run =
           [](Trial& t) {
             Call asked = t.request();
             asked.session = someip::SessionId{0x1234};
             for (int count = 0; count < 2; ++count) {
               t.answer_to(asked);
             }
           }},
      {.id = "rpc.request.parallel",
       .title = "answers each of 16 requests of several clients that come at once",
       .requirements = {"feat_req_someip_79"},
       .tc8 = {"SOMEIP_ETS_004"},
       .needs = call,
       .run =
           [](Trial& t) {
             std::vector<Call> calls;
             for (std::uint16_t count = 0; count < 16; ++count) {
               calls.push_back(t.request());
               calls.back().client = someip::ClientId{static_cast<std::uint16_t>(0x5a10U + count % 4U)};
             }
             const std::size_t since = t.now();
             const auto is_open = [&](const Call& one) {
               return one.session == someip::SessionId{} ||
                      t.messages_since(since, Trial::is_answer_to(one)).empty();
             };
             // Those again that are not answered yet.
             if (!t.ask(
                     [&] {
                       for (Call& one : calls) {
                         if (is_open(one)) {
                           one = t.send(one);
                         }
                       }
                     },
                     [&] { return std::ranges::none_of(calls, is_open); })) {
               const auto open = std::ranges::count_if(calls, is_open);
               t.missing(fmt::format("{} of {} requests are not answered", open, calls.size()),
                         fmt::format("{} responses", calls.size()));
             }
           }},
      {.id = "rpc.response.protocol-version",
       .title = "answers with Protocol Version 1",
       .requirements = {"feat_req_someip_90"},
       .tc8 = {"SOMEIPSRV_ONWIRE_05"},
       .needs = call,
       .run = response([](Trial& t, const Call&, const SeenMessage& seen) {
         t.equal("Protocol Version", 1, seen.message.header.protocol, seen.packet);
       })},
      {.id = "rpc.response.interface-version",
       .title = "answers with the major version of the service",
       .requirements = {"feat_req_someip_92"},
       .tc8 = {"SOMEIPSRV_ONWIRE_06"},
       .needs = call,
       .run = response([](Trial& t, const Call&, const SeenMessage& seen) {
         t.equal("Interface Version", t.profile.service().major, seen.message.header.interface_version,
                 seen.packet);
       })},
      {.id = "rpc.response.message-type",
       .title = "answers a good request with a response",
       .requirements = {"feat_req_someip_141", "feat_req_someip_684"},
       .tc8 = {"SOMEIPSRV_ONWIRE_07"},
       .needs = call,
       .run = response([](Trial& t, const Call&, const SeenMessage& seen) {
         t.equal("Message Type", MessageType::response, seen.message.header.type, seen.packet);
       })},
      {.id = "rpc.response.return-code",
       .title = "answers a good request with E_OK",
       .requirements = {"feat_req_someip_144", "feat_req_someip_367"},
       .tc8 = {"SOMEIPSRV_ONWIRE_11"},
       .needs = call,
       .run = response([](Trial& t, const Call&, const SeenMessage& seen) {
         t.equal("Return Code", ReturnCode::ok, seen.message.header.return_code, seen.packet);
       })},
      {.id = "rpc.instances.own-ports",
       .title = "answers each instance's requests from its own UDP port",
       .requirements = {"feat_req_someip_445", "feat_req_someip_648", "feat_req_someip_1079",
                        "feat_req_someipsd_782"},
       .tc8 = {"SOMEIPSRV_RPC_14"},
       .needs = call | Need::two_instances,
       .run =
           [](Trial& t) {
             for (const ServiceProfile& one : t.profile.services) {
               if (one.service == t.profile.service().service && one.request && one.udp_port) {
                 const SeenMessage seen =
                     t.answer_from(one, fmt::format("instance {:#06x}", value(one.instance)));
                 t.equal("UDP source port", *one.udp_port, seen.packet->from.port, seen.packet);
               }
             }
           }},
      {.id = "rpc.services.one-port",
       .title = "answers requests to a second service at the same port",
       .requirements = {"feat_req_someip_645", "feat_req_someip_732"},
       .tc8 = {"SOMEIPSRV_RPC_01"},
       .needs = call | Need::two_services,
       .run =
           [](Trial& t) {
             for (const ServiceProfile& one : t.profile.services) {
               if (one.service != t.profile.service().service && one.request &&
                   one.udp_port == t.profile.service().udp_port) {
                 t.good_answer_to(t.request(one));
                 t.good_answer_to(t.request());
                 return;
               }
             }
             t.unsupported("no two services share a port");
           }},

      // Errors.
      {.id = "rpc.error.unknown-service",
       .title = "answers a request to an unknown service with E_UNKNOWN_SERVICE",
       .level = tc8,
       .requirements = {"feat_req_someip_816", "feat_req_someip_371"},
       .tc8 = {"SOMEIPSRV_ONWIRE_10", "SOMEIP_ETS_077"},
       .needs = Need::udp,
       .run =
           [](Trial& t) {
             if (!t.profile.policy.answers_unknown_service) {
               t.unsupported(
                   "the profile says that unknown services are not answered (policy: "
                   "answers_unknown_service)");
             }
             Call asked = t.request();
             asked.service = someip::ServiceId{0x7abc};
             t.error_answer_to(asked, ReturnCode::unknown_service);
           }},
      {.id = "rpc.error.unknown-method",
       .title = "answers a request to an unknown method with E_UNKNOWN_METHOD",
       .level = tc8,
       .requirements = {"feat_req_someip_816", "feat_req_someip_371"},
       .tc8 = {"SOMEIPSRV_ONWIRE_12", "SOMEIP_ETS_076"},
       .needs = Need::udp,
       .run = error(
           [](Trial& t, const Call&, const SeenMessage& seen) {
             t.equal("Return Code", ReturnCode::unknown_method, seen.message.header.return_code, seen.packet);
           },
           true)},
      {.id = "rpc.error.code-range",
       .title = "leaves the two top bits of return codes 0",
       .requirements = {"feat_req_someip_371"},
       .tc8 = {"SOMEIPSRV_RPC_06"},
       .needs = Need::udp,
       .run = error([](Trial& t, const Call&, const SeenMessage& seen) {
         t.equal("top bits of the Return Code", 0U,
                 static_cast<unsigned>(seen.message.header.return_code) >> 6U, seen.packet);
       })},
      {.id = "rpc.error.no-payload",
       .title = "sends errors without payload",
       .requirements = {"feat_req_someip_655"},
       .tc8 = {"SOMEIPSRV_RPC_09"},
       .needs = Need::udp,
       .run = error([](Trial& t, const Call&, const SeenMessage& seen) {
         t.equal("bytes of payload", std::size_t{0}, seen.message.payload.size(), seen.packet);
       })},
      {.id = "rpc.error.message-id",
       .title = "copies the Message ID into errors",
       .requirements = {"feat_req_someip_655"},
       .tc8 = {"SOMEIPSRV_RPC_18"},
       .needs = Need::udp,
       .run = error([](Trial& t, const Call& asked, const SeenMessage& seen) {
         t.equal("Service ID", value(asked.service), value(seen.message.header.service), seen.packet);
         t.equal("Method ID", value(asked.method), value(seen.message.header.method), seen.packet);
       })},
      {.id = "rpc.error.request-id",
       .title = "copies the Request ID into errors",
       .requirements = {"feat_req_someip_655", "feat_req_someip_726", "feat_req_someip_106"},
       .tc8 = {"SOMEIPSRV_RPC_19"},
       .needs = Need::udp,
       .run = error([](Trial&, const Call&, const SeenMessage&) {})},
      {.id = "rpc.error.interface-version",
       .title = "copies the interface version into errors",
       .requirements = {"feat_req_someip_655"},
       .tc8 = {"SOMEIPSRV_RPC_20"},
       .needs = Need::udp,
       .run = error([](Trial& t, const Call& asked, const SeenMessage& seen) {
         t.equal("Interface Version", asked.interface_version, seen.message.header.interface_version,
                 seen.packet);
       })},

      // What must not be served.
      {.id = "rpc.reject.interface-version",
       .title = "does not serve a request with another interface version",
       .requirements = {"feat_req_someip_718"},
       .tc8 = {"SOMEIP_ETS_074"},
       .needs = call,
       .run = rejected([](Call& asked) {
         asked.interface_version = static_cast<std::uint8_t>(asked.interface_version + 9U);
       })},
      {.id = "rpc.reject.protocol-version",
       .title = "does not serve a request with another protocol version",
       .requirements = {"feat_req_someip_718", "feat_req_someip_703", "feat_req_someip_818"},
       .tc8 = {"SOMEIP_ETS_078"},
       .needs = call,
       .run = rejected([](Call& asked) { asked.protocol = 2; })},
      {.id = "rpc.reject.message-type",
       .title = "does not serve a message of unknown type",
       .requirements = {"feat_req_someip_718", "feat_req_someip_95"},
       .tc8 = {"SOMEIP_ETS_075"},
       .needs = call,
       .run = rejected([](Call& asked) { asked.type = MessageType{0x55}; })},
      {.id = "rpc.reject.acknowledgement-type",
       .title = "does not serve a message of the reserved type 0x40",
       .requirements = {"feat_req_someip_142"},
       .needs = call,
       .run = rejected([](Call& asked) { asked.type = MessageType{0x40}; })},
      {.id = "rpc.reject.length-zero",
       .title = "does not serve a request with Length 0",
       .requirements = {"feat_req_someip_798"},
       .tc8 = {"SOMEIP_ETS_054"},
       .needs = call,
       .run = broken_bytes([](Call& asked) { asked.length = 0; })},
      {.id = "rpc.reject.length-short",
       .title = "does not serve a request with Length 7",
       .requirements = {"feat_req_someip_798"},
       .tc8 = {"SOMEIP_ETS_055"},
       .needs = call,
       .run = broken_bytes([](Call& asked) { asked.length = 7; })},
      {.id = "rpc.reject.length-beyond",
       .title = "does not serve a request whose Length is beyond the datagram",
       .requirements = {"feat_req_someip_77", "feat_req_someip_718"},
       .tc8 = {"SOMEIP_ETS_058", "SOMEIP_ETS_001"},
       .needs = call,
       .run = broken_bytes([](Call& asked) { asked.length = 0x10000; })},
      {.id = "rpc.reject.length-huge",
       .title = "does not serve a request with Length 0xffffffff",
       .requirements = {"feat_req_someip_77", "feat_req_someip_718"},
       .needs = call,
       .run = broken_bytes([](Call& asked) { asked.length = 0xffff'ffff; })},

      // What must not be answered.
      {.id = "rpc.silence.fire-and-forget",
       .title = "does not answer a request without return",
       .requirements = {"feat_req_someip_345", "feat_req_someip_654"},
       .tc8 = {"SOMEIPSRV_RPC_04"},
       .needs = call | Need::fire_and_forget,
       .run = silence([](Trial& t, Call& asked) {
         asked = t.call(*t.profile.service().fire_and_forget);
         asked.type = MessageType::request_no_return;
       })},
      {.id = "rpc.silence.unknown-fire-and-forget",
       .title = "does not answer a request without return to an unknown method",
       .requirements = {"feat_req_someip_348", "feat_req_someip_654"},
       .tc8 = {"SOMEIPSRV_RPC_05"},
       .needs = call,
       .run = silence([](Trial&, Call& asked) {
         asked.method = unknown_method;
         asked.type = MessageType::request_no_return;
       })},
      {.id = "rpc.silence.fire-and-forget-version",
       .title = "does not answer a request without return with another interface version",
       .requirements = {"feat_req_someip_348", "feat_req_someip_654"},
       .tc8 = {"SOMEIP_ETS_059"},
       .needs = call | Need::fire_and_forget,
       .run = silence([](Trial& t, Call& asked) {
         asked = t.call(*t.profile.service().fire_and_forget);
         asked.type = MessageType::request_no_return;
         asked.interface_version = 0x77;
       })},
      {.id = "rpc.silence.wrong-type-to-fire-and-forget",
       .title = "does not answer a notification to a method without return",
       .requirements = {"feat_req_someip_597", "feat_req_someip_654"},
       .tc8 = {"SOMEIPSRV_RPC_10"},
       .needs = call | Need::fire_and_forget,
       .run = silence([](Trial& t, Call& asked) {
         asked = t.call(*t.profile.service().fire_and_forget);
         asked.type = MessageType::notification;
       })},
      {.id = "rpc.silence.notification",
       .title = "does not answer a notification",
       .requirements = {"feat_req_someip_597"},
       .needs = call,
       .run = silence([](Trial&, Call& asked) {
         asked.method = someip::MethodId{0x8abc};
         asked.type = MessageType::notification;
       })},
      {.id = "rpc.silence.response",
       .title = "does not answer a response that nobody asked for",
       .requirements = {"feat_req_someip_704", "feat_req_someip_718"},
       .needs = call,
       .run = silence([](Trial&, Call& asked) { asked.type = MessageType::response; })},
      {.id = "rpc.silence.error",
       .title = "does not answer an error",
       .requirements = {"feat_req_someip_704"},
       .needs = call,
       .run = silence([](Trial&, Call& asked) {
         asked.type = MessageType::error;
         asked.code = ReturnCode::not_ok;
       })},
      {.id = "rpc.silence.error-request",
       .title = "sends no error for a request that carries an error code itself",
       .requirements = {"feat_req_someip_704"},
       .tc8 = {"SOMEIPSRV_RPC_08"},
       .needs = call,
       .run = silence([](Trial&, Call& asked) {
         asked.method = unknown_method;
         asked.code = ReturnCode::not_ok;
       })},
      {.id = "rpc.request.return-code-ignored",
       .title = "answers a request with return code 0xc0 as any other",
       .level = tc8,
       .requirements = {"feat_req_someip_704"},
       .tc8 = {"SOMEIPSRV_RPC_07"},
       .needs = call,
       .run =
           [](Trial& t) {
             if (!t.profile.policy.processes_request_with_return_code) {
               t.unsupported(
                   "the profile says that such requests are dropped (policy: "
                   "processes_request_with_return_code)");
             }
             Call asked = t.request();
             asked.code = ReturnCode{0xc0};
             t.good_answer_to(asked);
           }},

      // Several messages in a datagram.
      {.id = "rpc.npdu.two",
       .title = "answers two requests in one datagram",
       .requirements = {"feat_req_someip_702", "feat_req_someip_319"},
       .tc8 = {"SOMEIP_ETS_061"},
       .needs = call,
       .run = [](Trial& t) { several_in_a_datagram(t, 2); }},
      {.id = "rpc.npdu.unaligned",
       .title = "answers three requests in one datagram, of which two are unaligned",
       .requirements = {"feat_req_someip_664", "feat_req_someip_702"},
       .tc8 = {"SOMEIP_ETS_069"},
       .needs = call,
       .run = [](Trial& t) { several_in_a_datagram(t, 3); }},
      {.id = "rpc.npdu.full",
       .title = "answers each of as many requests as fit in one datagram",
       .requirements = {"feat_req_someip_702", "feat_req_someip_319"},
       .needs = call,
       .run =
           [](Trial& t) {
             several_in_a_datagram(t, static_cast<unsigned>(1400 / t.request().encode().size()));
           }},

      {.id = "rpc.npdu.unknown",
       .title = "answers a request behind messages that it does not know in one datagram",
       .requirements = {"feat_req_someipcompat_1201", "feat_req_someip_702"},
       .needs = call,
       .run =
           [](Trial& t) {
             Call other = t.request();
             other.service = someip::ServiceId{0x7abc};
             other.type = MessageType::request_no_return;
             Bytes before = other.encode();
             other = t.request();
             other.method = someip::MethodId{0x8abc};
             other.type = MessageType::notification;
             append(before, other.encode());
             several_in_a_datagram(t, 1, before);
           }},

      // Fields.
      {.id = "rpc.field.get",
       .title = "answers a getter with the value of the field",
       .requirements = {"feat_req_someip_633"},
       .tc8 = {"SOMEIPSRV_RPC_03"},
       .needs = call | Need::field,
       .run =
           [](Trial& t) {
             // A field may be of variable length, so that it is set to a known one.
             t.answer_to(setter(t, t.profile.service().field->value));
             const SeenMessage seen = t.good_answer_to(getter(t));
             t.equal("bytes of the value", t.profile.service().field->value.size(),
                     seen.message.payload.size(), seen.packet);
           }},
      {.id = "rpc.field.set",
       .title = "answers a setter with the value that is set",
       .requirements = {"feat_req_someip_634"},
       .tc8 = {"SOMEIPSRV_RPC_11"},
       .needs = call | Need::field,
       .run =
           [](Trial& t) {
             const Bytes& wanted = t.profile.service().field->value;
             const SeenMessage seen = t.good_answer_to(setter(t, wanted));
             t.equal("value", hex(wanted), hex(seen.message.payload), seen.packet);
           }},
      {.id = "rpc.field.set-is-kept",
       .title = "gives the value that was set when it is asked again",
       .requirements = {"feat_req_someip_633", "feat_req_someip_634"},
       .needs = call | Need::field,
       .run =
           [](Trial& t) {
             const Bytes& wanted = t.profile.service().field->value;
             t.good_answer_to(setter(t, wanted));
             const SeenMessage seen = t.good_answer_to(getter(t));
             t.equal("value", hex(wanted), hex(seen.message.payload), seen.packet);
           }},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
