/* sd/c: Trestle for C, a SOME/IP device over UDP with service discovery, for firmware that is not C++.
 *
 * The same as trestle::device::Device (sd/core/device/device.hpp), whose documentation tells more: offers
 * services, answers methods and fields, sends events, finds, calls and subscribes to services of others;
 * large messages in segments, both ways. It has no I/O, clock, threads or heap: the caller gives the memory,
 * passes in what arrives and what time it is, and asks what to send, what happened, and when to ask again.
 *
 *     #define LIMITS 1, 1, 1, 4, 4, 0, 0, 0, 0, 8, 8, 4, 512, 1, 8192, 1
 *     static const trestle_limits limits = {LIMITS};
 *     static uint64_t memory[TRESTLE_MEMORY_BYTES(LIMITS) / 8];
 *     trestle_device *device;
 *     trestle_init(memory, sizeof memory, &limits, &settings, &device);
 *     trestle_offer(device, 0, now_ns());
 *     for (;;) {
 *       if (received) { trestle_on_datagram(device, bytes, size, &from, &to, now_ns()); }
 *       trestle_on_time(device, now_ns());
 *       do {
 *         while (trestle_poll_transmit(device, room, sizeof room, now_ns(), &out)) { udp_send(&out); }
 *       } while (trestle_poll_happening(device, &what) && handle(&what));
 *     }
 *
 * In that order: an Ack must leave before initial events [feat_req_someipsd_107]; the memory of a datagram
 * must stay as it is until trestle_poll_happening() has returned false. Times are nanoseconds of a clock that
 * never goes back. Nothing here may be called from two threads, or an interrupt, at once. Null pointers are
 * allowed only where it is said. Calls that return trestle_status change nothing when it is not TRESTLE_OK.
 */
#ifndef TRESTLE_H
#define TRESTLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** A device in the caller's memory. */
typedef struct trestle_device trestle_device;

/** How a call ended: anything but TRESTLE_OK has changed nothing. */
typedef enum trestle_status {
  TRESTLE_OK = 0,
  /** No such service, method, event, field or need, or one that cannot be: trestle_bad() tells which. */
  TRESTLE_BAD_ARGUMENT,
  TRESTLE_TABLE_FULL,  /**< a limit for it is reached */
  TRESTLE_DUPLICATE,   /**< it is offered or needed already */
  TRESTLE_NOT_OFFERED, /**< the service is not offered now */
  TRESTLE_UNAVAILABLE, /**< nobody offers the needed service now */
  TRESTLE_NO_ROOM,     /**< too much waits to be sent: trestle_poll_transmit() makes room */
  TRESTLE_BUSY,        /**< the field's value is being sent, in segments */
  TRESTLE_TOO_LARGE,   /**< more than the field's room, or than a message can carry */
  TRESTLE_BAD_LIMITS,  /**< limits that break their own rules, see trestle_limits */
  TRESTLE_NO_MEMORY    /**< the memory is too small, or not aligned to 8 bytes */
} trestle_status;

/** Which argument of a call cannot be, or which member of the service or need that the call is about. */
typedef enum trestle_argument {
  TRESTLE_ARGUMENT_NONE = 0,
  /* Of a call. */
  TRESTLE_ARGUMENT_SERVICE, /**< a place in trestle_settings.services */
  TRESTLE_ARGUMENT_NEED,    /**< a place in trestle_settings.needs */
  TRESTLE_ARGUMENT_FIELD,   /**< a place in trestle_service.fields */
  TRESTLE_ARGUMENT_EVENT,   /**< the id of an event of the service; a notifier goes by trestle_set_field() */
  TRESTLE_ARGUMENT_REQUEST, /**< trestle_accept(): of a setter of the service */
  TRESTLE_ARGUMENT_RETURN_CODE, /**< trestle_respond_error(): not TRESTLE_E_OK */
  /* Of a service or need. */
  TRESTLE_ARGUMENT_SERVICE_ID,   /**< 0x0001 to 0xfffd */
  TRESTLE_ARGUMENT_INSTANCE,     /**< not 0; and not 0xffff, to offer it or to subscribe */
  TRESTLE_ARGUMENT_MAJOR,        /**< of an offered service: not 0xff */
  TRESTLE_ARGUMENT_PORT,         /**< not 0, and not the port of discovery */
  TRESTLE_ARGUMENT_TTL,          /**< trestle_settings.ttl_s */
  TRESTLE_ARGUMENT_SUBSCRIPTION, /**< of a need: eventgroups[index] is 0x0001 to 0xfffe */
  TRESTLE_ARGUMENT_DISCOVERY,    /**< trestle_settings.own: a unicast address */
  /* Of a service, its member `index`. No id may be that of another member. [feat_req_someip_625] */
  TRESTLE_ARGUMENT_EVENTGROUP,          /**< eventgroups[index]: 0x0001 to 0xfffe */
  TRESTLE_ARGUMENT_METHOD,              /**< methods[index]: an id, and a kind */
  TRESTLE_ARGUMENT_LISTED_EVENT,        /**< events[index]: an id */
  TRESTLE_ARGUMENT_EVENT_EVENTGROUPS,   /**< events[index]: all among those of the service */
  TRESTLE_ARGUMENT_FIELD_GETTER,        /**< fields[index]: an id, or 0 */
  TRESTLE_ARGUMENT_FIELD_SETTER,        /**< likewise */
  TRESTLE_ARGUMENT_FIELD_NOTIFIER,      /**< likewise */
  TRESTLE_ARGUMENT_FIELD_EVENTGROUPS,   /**< fields[index]: all among those of the service */
  TRESTLE_ARGUMENT_FIELD_INITIAL_BYTES, /**< fields[index]: at most room_bytes */
  /* Of trestle_settings. */
  TRESTLE_ARGUMENT_INITIAL_DELAY,          /**< initial_delay_min_ms: at most initial_delay_max_ms */
  TRESTLE_ARGUMENT_REQUEST_RESPONSE_DELAY, /**< request_response_delay_min_ms: likewise */
  TRESTLE_ARGUMENT_TP_BURST                /**< tp_burst: at least 1 */
} trestle_argument;

/** Some return codes; 0x20 to 0x5e are the application's. */
enum {
  TRESTLE_E_OK = 0x00,
  TRESTLE_E_NOT_OK = 0x01,
  TRESTLE_E_NOT_READY = 0x04,
  TRESTLE_E_TIMEOUT = 0x06,
  TRESTLE_E_MALFORMED_MESSAGE = 0x09
};

/** An address and a port. IPv4 uses the first four bytes. */
typedef struct trestle_endpoint {
  uint8_t address[16]; /**< network order */
  bool v6;
  uint16_t port; /**< in the machine's order */
} trestle_endpoint;

/** How much the device holds; see trestle::device::Limits. */
typedef struct trestle_limits {
  uint16_t services;
  uint16_t eventgroups; /**< of all services */
  uint16_t events;      /**< events and fields of all services */
  uint16_t subscribers; /**< of all eventgroups */
  uint16_t peers;       /**< other nodes that discovery keeps in mind */
  uint16_t needs;
  uint16_t subscriptions;   /**< of all needs */
  uint16_t remote_services; /**< that others offer: at least `needs` */
  uint16_t calls;           /**< outstanding at a time; none without needs */
  uint16_t pending_entries; /**< of discovery: at least services + subscriptions */
  uint16_t pending_events;  /**< of discovery: a peer's reboot needs one for each of its subscriptions */
  uint16_t sends;           /**< messages that wait to be sent: at least 2 */
  uint16_t send_bytes;      /**< payload of them that is copied, in bytes */
  uint16_t tp_buffers;      /**< large messages being received at a time */
  uint32_t tp_buffer_bytes; /**< the largest of them */
  uint16_t methods;         /**< of all services */
} trestle_limits;

/** Bytes of memory for a device with these limits, as a constant: an upper bound, a multiple of 8. The
 * arguments are those of trestle_limits in their order, so that one list serves both. */
#define TRESTLE_MEMORY_BYTES(...) TRESTLE_MEMORY_BYTES_(__VA_ARGS__)

/** The same, exactly, for limits that are known at run time only. */
size_t trestle_memory_bytes(const trestle_limits* limits);

/* ---- What the device offers and needs: copied by trestle_init(), but for the room of fields ---- */

/** Most eventgroups of one event or field. */
#define TRESTLE_EVENTGROUPS_PER_EVENT 4

/** How a method is called: with a response, without one, or as the caller likes. */
typedef enum trestle_method_kind {
  TRESTLE_REQUEST_RESPONSE = 1,
  TRESTLE_FIRE_AND_FORGET = 2,
  TRESTLE_EITHER = 3
} trestle_method_kind;

/** A method that the device answers. */
typedef struct trestle_method {
  uint16_t id; /**< best 0x0001 to 0x7ffe, see TRESTLE_UNUSUAL_ID */
  trestle_method_kind kind;
} trestle_method;

/** An event, and the eventgroups whose subscribers get it: the first 0 ends the list. */
typedef struct trestle_event {
  uint16_t id; /**< best 0x8001 to 0xfffe, see TRESTLE_UNUSUAL_ID */
  uint16_t eventgroups[TRESTLE_EVENTGROUPS_PER_EVENT];
} trestle_event;

/** A field: any of getter, setter and notifier, 0 for those it has not. [feat_req_someip_631] */
typedef struct trestle_field {
  uint16_t getter;
  uint16_t setter;
  uint16_t notifier;
  uint16_t eventgroups[TRESTLE_EVENTGROUPS_PER_EVENT]; /**< of the notifier */
  uint8_t* room; /**< where the value is kept; only the device writes there */
  size_t room_bytes;
  bool has_value; /**< the first `initial_bytes` of `room` are the value at first */
  size_t initial_bytes;
  /** What a setter brings comes as TRESTLE_REQUEST: trestle_accept() or trestle_respond_error(). */
  bool judged;
} trestle_field;

/** A service to offer. trestle_init() copies it and its tables, except the room of fields. */
typedef struct trestle_service {
  uint16_t service;
  uint16_t instance;
  uint8_t major;
  uint32_t minor;
  uint16_t port; /**< UDP, not discovery's */
  const trestle_method* methods;
  size_t method_count;
  const trestle_event* events;
  size_t event_count;
  const trestle_field* fields;
  size_t field_count;
  const uint16_t* eventgroups; /**< all that events and fields name */
  size_t eventgroup_count;
} trestle_service;

/** A service to call, and to subscribe to. */
typedef struct trestle_need {
  uint16_t service;
  uint16_t instance; /**< 0xffff: any, without eventgroups */
  uint8_t major;
  uint16_t port; /**< UDP, that calls leave from and events come to; not discovery's */
  /* Bytes of datagrams to that port that can be held until the next poll, told to servers that pace by it,
   * but send 4 segments at once at least; 0: they are not told. */
  uint32_t receive_buffer_bytes;
  const uint16_t* eventgroups; /**< to subscribe to */
  size_t eventgroup_count;
} trestle_need;

/** What a device is made with; trestle_default_settings() gives the defaults. */
typedef struct trestle_settings {
  trestle_endpoint own;       /**< the device's address, and the port of discovery: 30490 */
  trestle_endpoint multicast; /**< where discovery talks to all */
  uint64_t seed;              /**< randomness for delays: unlike other devices' */
  uint16_t client;            /**< the Client ID of calls [feat_req_someip_699] */
  const trestle_service* services;
  size_t service_count;
  const trestle_need* needs;
  size_t need_count;
  /* Of discovery, in milliseconds. [feat_req_someipsd_62] [feat_req_someipsd_79] */
  uint32_t initial_delay_min_ms;
  uint32_t initial_delay_max_ms;
  uint32_t repetitions_base_delay_ms;
  uint8_t repetitions_max;
  uint32_t cyclic_offer_delay_ms;
  uint32_t request_response_delay_min_ms;
  uint32_t request_response_delay_max_ms;
  uint32_t ttl_s; /**< 1 to 0xffffff */
  /* Of large messages: segments to each receiver at once, at least 1, and the pause after them. */
  uint16_t tp_burst;
  uint32_t tp_separation_us;
  uint32_t reassembly_timeout_ms;
} trestle_settings;

/** Fills in what the specification, or Trestle, has by default: all but own.address, seed, services, needs.
 */
void trestle_default_settings(trestle_settings* settings);

/** Makes a device in `memory`, which must be aligned to 8 bytes, have TRESTLE_MEMORY_BYTES, outlive the
 * device, and serve nothing else. There is no end to a device: forget it, after trestle_shutdown().
 * TRESTLE_BAD_LIMITS, TRESTLE_NO_MEMORY, or TRESTLE_TABLE_FULL: the tables are larger than the limits. */
trestle_status trestle_init(void* memory, size_t bytes, const trestle_limits* limits,
                            const trestle_settings* settings, trestle_device** device);

/** Which argument was wrong of the last call that returned TRESTLE_BAD_ARGUMENT for this device.
 * @param index  is told which member of a table, where it is one; may be null. */
trestle_argument trestle_bad(const trestle_device* device, size_t* index);
/** The same of trestle_init(), when it returns TRESTLE_BAD_ARGUMENT; else TRESTLE_ARGUMENT_NONE. */
trestle_argument trestle_bad_setting(const trestle_settings* settings);
/** Its name, for logs, such as "field_getter". */
const char* trestle_argument_name(trestle_argument argument);

/* ---- Server. Services and fields are named by their place in the tables. ---- */

/** BAD_ARGUMENT, DUPLICATE, TABLE_FULL. [feat_req_someipsd_22] */
trestle_status trestle_offer(trestle_device* device, size_t service, uint64_t now_ns);
void trestle_withdraw(trestle_device* device, size_t service, uint64_t now_ns);

/** Sends an event to its subscribers. A payload of at most trestle_max_copied_bytes() is copied; a larger one
 * must stay as it is until TRESTLE_SEND_FINISHED, which does not come when there are no subscribers.
 * BAD_ARGUMENT (also: a field's notifier), NOT_OFFERED, NO_ROOM, TOO_LARGE. */
trestle_status trestle_notify(trestle_device* device, size_t service, uint16_t event, const uint8_t* payload,
                              size_t size);
/** Sets a field and tells its subscribers if it differs. [feat_req_someip_635]
 * BAD_ARGUMENT, NOT_OFFERED, TOO_LARGE, NO_ROOM, BUSY. */
trestle_status trestle_set_field(trestle_device* device, size_t service, size_t field, const uint8_t* value,
                                 size_t size);
/** Where the value of a field is, and its size; null: it has none, there is no such field, or the service is
 * not offered. Valid until the value changes. */
const uint8_t* trestle_field_value(const trestle_device* device, size_t service, size_t field, size_t* size);
/** How many endpoints get an event or notifier. */
size_t trestle_subscribers(const trestle_device* device, size_t service, uint16_t event);
size_t trestle_max_copied_bytes(const trestle_device* device);

/** What is needed to answer a request: to be kept as long as one likes. */
typedef struct trestle_request {
  size_t service; /**< its place in the table */
  trestle_endpoint from;
  uint16_t service_id;
  uint16_t method;
  uint16_t client;
  uint16_t session;
  uint8_t protocol;
  uint8_t interface_version;
  uint8_t type;
  uint8_t return_code;
} trestle_request;

/** Answers a request, once, now or later; nothing is sent for fire and forget. Payload as of
 * trestle_notify(). BAD_ARGUMENT, NO_ROOM, TOO_LARGE. [feat_req_someip_338] */
trestle_status trestle_respond(trestle_device* device, const trestle_request* request, const uint8_t* payload,
                               size_t size);
/** With an error: any but TRESTLE_E_OK. [feat_req_someip_655] */
trestle_status trestle_respond_error(trestle_device* device, const trestle_request* request,
                                     uint8_t return_code);
/** Answers a judged setter with `value`, sets the field to it, and tells its subscribers. Errors as of
 * trestle_set_field(). [feat_req_someip_634] */
trestle_status trestle_accept(trestle_device* device, const trestle_request* request, const uint8_t* value,
                              size_t size);

/* ---- Client. Needs are named by their place in the table. ---- */

/** Looks for the service, and subscribes when it is there. BAD_ARGUMENT, DUPLICATE, TABLE_FULL.
 * [feat_req_someipsd_18] */
trestle_status trestle_require(trestle_device* device, size_t need, uint64_t now_ns);
void trestle_release(trestle_device* device, size_t need, uint64_t now_ns);
bool trestle_available(trestle_device* device, size_t need);
/** Calls a method: TRESTLE_CALL_ENDED tells how it ended. Payload as of trestle_notify().
 * @param call  is told the number of the call, never 0.
 * BAD_ARGUMENT, UNAVAILABLE, TABLE_FULL, NO_ROOM, TOO_LARGE. */
trestle_status trestle_call(trestle_device* device, size_t need, uint16_t method, const uint8_t* payload,
                            size_t size, uint64_t timeout_ns, uint64_t now_ns, uint32_t* call);
/** Fire and forget. Errors as of trestle_call(). */
trestle_status trestle_tell(trestle_device* device, size_t need, uint16_t method, const uint8_t* payload,
                            size_t size);
/** False for a call that has ended. */
bool trestle_cancel(trestle_device* device, uint32_t call);

/* ---- Both ---- */

void trestle_link_down(trestle_device* device);
void trestle_link_up(trestle_device* device, uint64_t now_ns);
/** Withdraws everything: drain trestle_poll_transmit() once more. [feat_req_someipsd_821] */
void trestle_shutdown(trestle_device* device, uint64_t now_ns);

/** Takes a datagram that was sent to `to`: the own address or a group that was joined, and the port. */
void trestle_on_datagram(trestle_device* device, const uint8_t* datagram, size_t size,
                         const trestle_endpoint* from, const trestle_endpoint* to, uint64_t now_ns);
/** Nobody listens there (ICMP): its subscriptions end. [feat_req_someipsd_435] */
void trestle_unreachable(trestle_device* device, const trestle_endpoint* receiver);
void trestle_on_time(trestle_device* device, uint64_t now_ns);

/** Any datagram of the device fits into so many bytes. */
#define TRESTLE_DATAGRAM_BYTES 1416

/** A datagram to send. */
typedef struct trestle_transmit {
  uint16_t from_port; /**< to be sent from this port of the own address */
  trestle_endpoint to;
  const uint8_t* bytes; /**< in `room` */
  size_t size;
} trestle_transmit;

/** The next datagram to send now; false: none. */
bool trestle_poll_transmit(trestle_device* device, uint8_t* room, size_t room_bytes, uint64_t now_ns,
                           trestle_transmit* transmit);

/** What a trestle_happening is about, and which of its members are set. */
typedef enum trestle_happening_kind {
  TRESTLE_REQUEST = 1,          /**< request, payload: a method is called, or a judged setter */
  TRESTLE_FIELD_SET,            /**< index, part: the field; payload: its value */
  TRESTLE_EVENT,                /**< index, part: the eventgroup of the need; method: the event; payload */
  TRESTLE_CALL_ENDED,           /**< call, answered, return_code, payload */
  TRESTLE_SERVICE_AVAILABLE,    /**< index: the need; peer: where it is */
  TRESTLE_SERVICE_LOST,         /**< likewise */
  TRESTLE_SUBSCRIBED,           /**< index, part; peer: the multicast group to join, if its port is not 0 */
  TRESTLE_SUBSCRIPTION_REFUSED, /**< index, part */
  TRESTLE_SUBSCRIPTION_LOST,    /**< index, part */
  TRESTLE_SUBSCRIBER_ADDED,     /**< index: the service; eventgroup; peer */
  TRESTLE_SUBSCRIBER_REMOVED,   /**< likewise */
  TRESTLE_SEND_FINISHED, /**< payload: where one began that is not needed any more; its size is not told */
  TRESTLE_UNUSUAL_ID /**< index: the service, now offered; method: an id of it that is reserved or meant for
                            the other kind, as that of an event below 0x8000 [feat_req_someip_626] */
} trestle_happening_kind;

/** What happened; members that the kind does not name are 0. `payload` is valid until the next call of
 * trestle_on_datagram(), trestle_poll_happening() or trestle_poll_transmit(). */
typedef struct trestle_happening {
  trestle_happening_kind kind;
  size_t index; /**< of the service or need */
  size_t part;  /**< of the field, or of the eventgroup of a need */
  trestle_request request;
  uint16_t method;
  uint16_t eventgroup;
  uint32_t call;
  bool answered; /**< else no answer came in time [feat_req_someip_436] */
  uint8_t return_code;
  trestle_endpoint peer;
  const uint8_t* payload;
  size_t size;
} trestle_happening;

/** The next happening; false: none. To be asked when trestle_poll_transmit() has nothing more, and then that
 * again. */
bool trestle_poll_happening(trestle_device* device, trestle_happening* happening);

/** When to call trestle_on_time() and poll again, perhaps in the past. False: when a datagram arrives or a
 * call is made. */
bool trestle_deadline(const trestle_device* device, uint64_t* deadline_ns);

/** Since the start, modulo 2^32; see trestle::device::Counters. */
typedef struct trestle_counters {
  uint32_t datagrams_received;
  uint32_t datagrams_sent;
  uint32_t requests;
  uint32_t events;
  uint32_t requests_answered;
  uint32_t malformed;
  uint32_t unexpected;
  uint32_t unknown_sender;
  uint32_t wrong_version;
  uint32_t bad_return_code;
  uint32_t not_polled;
  uint32_t not_reassembled;
  uint32_t send_queue_full;
  uint32_t room_too_small;
} trestle_counters;
void trestle_get_counters(const trestle_device* device, trestle_counters* counters);

/* ---- Of TRESTLE_MEMORY_BYTES: upper bounds of slots, which the library checks when it is built ---- */
#define TRESTLE_SLOT_(bytes, pointers) ((bytes) + (pointers) * sizeof(void*))
#ifdef __unix__ /* a host, whose library also guards against crowds: known_failures.hpp */
#define TRESTLE_OBJECT_BYTES_ TRESTLE_SLOT_(3360, 88)
#define TRESTLE_REMOTE_BYTES_ TRESTLE_SLOT_(136, 0)
#else
#define TRESTLE_OBJECT_BYTES_ TRESTLE_SLOT_(1208, 86)
#define TRESTLE_REMOTE_BYTES_ TRESTLE_SLOT_(128, 0)
#endif
#define TRESTLE_SERVICE_BYTES_ TRESTLE_SLOT_(180, 12)
#define TRESTLE_EVENTGROUP_BYTES_ TRESTLE_SLOT_(64, 0)
#define TRESTLE_EVENT_BYTES_ TRESTLE_SLOT_(40, 8)
#define TRESTLE_SUBSCRIBER_BYTES_ TRESTLE_SLOT_(104, 0)
#define TRESTLE_PEER_BYTES_ TRESTLE_SLOT_(80, 2)
#define TRESTLE_NEED_BYTES_ TRESTLE_SLOT_(100, 4)
#define TRESTLE_SUBSCRIPTION_BYTES_ TRESTLE_SLOT_(190, 2)
#define TRESTLE_CALL_BYTES_ TRESTLE_SLOT_(66, 0)
#define TRESTLE_ENTRY_BYTES_ TRESTLE_SLOT_(160, 0)
#define TRESTLE_NOTE_BYTES_ TRESTLE_SLOT_(128, 0)
#define TRESTLE_SEND_BYTES_ TRESTLE_SLOT_(56, 4)
#define TRESTLE_TP_BYTES_ TRESTLE_SLOT_(68, 6)
#define TRESTLE_METHOD_BYTES_ TRESTLE_SLOT_(4, 0)
#define TRESTLE_MEMORY_BYTES_(services, eventgroups, events, subscribers, peers, needs, subscriptions,    \
                              remote_services, calls, pending_entries, pending_events, sends, send_bytes, \
                              tp_buffers, tp_buffer_bytes, methods)                                       \
  ((TRESTLE_OBJECT_BYTES_ + 256U + (services)*TRESTLE_SERVICE_BYTES_ +                                    \
    (eventgroups)*TRESTLE_EVENTGROUP_BYTES_ + (events)*TRESTLE_EVENT_BYTES_ +                             \
    (subscribers)*TRESTLE_SUBSCRIBER_BYTES_ + ((peers) + 1) * TRESTLE_PEER_BYTES_ +                       \
    (needs)*TRESTLE_NEED_BYTES_ + (subscriptions)*TRESTLE_SUBSCRIPTION_BYTES_ +                           \
    (remote_services)*TRESTLE_REMOTE_BYTES_ + (calls)*TRESTLE_CALL_BYTES_ +                               \
    (pending_entries)*TRESTLE_ENTRY_BYTES_ + (pending_events)*TRESTLE_NOTE_BYTES_ +                       \
    (sends) * (TRESTLE_SEND_BYTES_ + ((subscribers) + 7U) / 8U) + (send_bytes) +                          \
    (tp_buffers) * (TRESTLE_TP_BYTES_ + ((tp_buffer_bytes) + 511U) / 512U * 4U + (tp_buffer_bytes)) +     \
    (methods)*TRESTLE_METHOD_BYTES_ + 7) /                                                                \
   8 * 8)

#ifdef __cplusplus
}
#endif

#endif
