/* A SOME/IP device in C, on POSIX sockets: usage: c_device ADDRESS [GROUP]
 *
 * Offers service 0x1234.0x0001 at UDP 30501:
 *   method 0x0001                     answers with the request's bytes in reverse order
 *   field  0x0010 / 0x0011 / 0x8010   two bytes, in eventgroup 1
 *   event  0x8001                     four times a second, in eventgroup 1: a number that counts
 *   event  0x8002                     once a second, in eventgroup 2: 8 KB, in segments
 * and needs service 0x2222.0x0001: calls its method 0x0001 when it is there, and subscribes to eventgroup 1.
 * Ends on SIGINT or SIGTERM. On a microcontroller, the functions between here and main() are the port.
 */
/* Of clock_gettime() and multicast groups, in C11. */
#define _DEFAULT_SOURCE /* NOLINT(bugprone-reserved-identifier) */
#include <arpa/inet.h>
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <trestle/trestle.h>

enum { SERVICE_PORT = 30501, NEED_PORT = 30601, LARGE_BYTES = 8192 };

/* ---- The port: clock, randomness, sending and receiving ---- */

static uint64_t now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (uint64_t)now.tv_sec * 1000000000U + (uint64_t)now.tv_nsec;
}

typedef struct port {
  int socket;
  trestle_endpoint local; /* where datagrams that it receives were sent to */
} port;

enum { UNICAST, MULTICAST, SERVICE, NEED, PORTS };
static port ports[PORTS];

static struct sockaddr_in to_system(const trestle_endpoint* from) {
  struct sockaddr_in to;
  memset(&to, 0, sizeof to);
  to.sin_family = AF_INET;
  to.sin_port = htons(from->port);
  memcpy(&to.sin_addr, from->address, 4);
  return to;
}

static trestle_endpoint from_system(const struct sockaddr_in* from) {
  trestle_endpoint to;
  memset(&to, 0, sizeof to);
  memcpy(to.address, &from->sin_addr, 4);
  to.port = ntohs(from->sin_port);
  return to;
}

static bool open_port(port* opened, const trestle_endpoint* local, const trestle_endpoint* own) {
  const struct sockaddr_in at = to_system(local);
  const struct sockaddr_in interface = to_system(own);
  const int yes = 1;
  opened->local = *local;
  opened->socket = socket(AF_INET, SOCK_DGRAM, 0);
  if (opened->socket < 0 || setsockopt(opened->socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
      bind(opened->socket, (const struct sockaddr*)&at, sizeof at) != 0 ||
      setsockopt(opened->socket, IPPROTO_IP, IP_MULTICAST_IF, &interface.sin_addr,
                 sizeof interface.sin_addr) != 0) {
    return false;
  }
  if (IN_MULTICAST(ntohl(at.sin_addr.s_addr))) {
    struct ip_mreq group;
    group.imr_multiaddr = at.sin_addr;
    group.imr_interface = interface.sin_addr;
    return setsockopt(opened->socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) == 0;
  }
  return true;
}

static void send_datagram(const trestle_transmit* out) {
  const struct sockaddr_in to = to_system(&out->to);
  for (size_t i = 0; i < PORTS; ++i) {
    if (i != MULTICAST && ports[i].local.port == out->from_port) {
      /* What the network does not take is lost, as UDP is anywhere. */
      (void)!sendto(ports[i].socket, out->bytes, out->size, 0, (const struct sockaddr*)&to, sizeof to);
      return;
    }
  }
}

/* ---- The device: what it is ---- */

/* services, eventgroups, events, subscribers, peers, needs, subscriptions, remote services, calls, pending
 * entries and events, sends, bytes of them, TP buffers, bytes of them, methods */
#define LIMITS 1, 2, 3, 8, 8, 1, 1, 1, 2, 8, 8, 8, 1400, 1, 8192, 1

static const trestle_limits limits = {LIMITS};
static uint64_t memory[TRESTLE_MEMORY_BYTES(LIMITS) / 8];
static trestle_device* device;

static const uint16_t eventgroups[] = {1, 2};
static const trestle_method methods[] = {{0x0001, TRESTLE_REQUEST_RESPONSE}};
static const trestle_event events[] = {{0x8001, {1}}, {0x8002, {2}}};
static uint8_t limit[2] = {0x00, 0x64};
static const trestle_field fields[] = {{.getter = 0x0010,
                                        .setter = 0x0011,
                                        .notifier = 0x8010,
                                        .eventgroups = {1},
                                        .room = limit,
                                        .room_bytes = sizeof limit,
                                        .has_value = true,
                                        .initial_bytes = sizeof limit}};
static const trestle_service services[] = {{.service = 0x1234,
                                            .instance = 0x0001,
                                            .major = 1,
                                            .port = SERVICE_PORT,
                                            .methods = methods,
                                            .method_count = 1,
                                            .events = events,
                                            .event_count = 2,
                                            .fields = fields,
                                            .field_count = 1,
                                            .eventgroups = eventgroups,
                                            .eventgroup_count = 2}};
static const trestle_need needs[] = {{.service = 0x2222,
                                      .instance = 0x0001,
                                      .major = 1,
                                      .port = NEED_PORT,
                                      .eventgroups = eventgroups,
                                      .eventgroup_count = 1}};

/* ---- What it does ---- */

static uint8_t large[LARGE_BYTES];
static bool large_is_free = true;

static void print_payload(const char* what, const trestle_happening* happening) {
  printf("%s", what);
  for (size_t i = 0; i < happening->size; ++i) {
    printf(" %02x", happening->payload[i]);
  }
  printf("\n");
}

static void answer(const trestle_happening* happening) {
  uint8_t reversed[64];
  if (happening->size > sizeof reversed) {
    (void)trestle_respond_error(device, &happening->request, TRESTLE_E_MALFORMED_MESSAGE);
    return;
  }
  for (size_t i = 0; i < happening->size; ++i) {
    reversed[i] = happening->payload[happening->size - 1 - i];
  }
  (void)trestle_respond(device, &happening->request, reversed, happening->size);
}

static void handle(const trestle_happening* happening) {
  static const uint8_t question[] = {0x2a};
  uint32_t call;
  switch (happening->kind) {
    case TRESTLE_REQUEST:
      print_payload("asked:", happening);
      answer(happening);
      break;
    case TRESTLE_FIELD_SET:
      print_payload("limit:", happening);
      break;
    case TRESTLE_SUBSCRIBER_ADDED:
      printf("subscriber of eventgroup %u\n", happening->eventgroup);
      break;
    case TRESTLE_SEND_FINISHED:
      large_is_free = true;
      break;
    case TRESTLE_SERVICE_AVAILABLE:
      (void)trestle_call(device, happening->index, 0x0001, question, sizeof question, 1000000000U, now_ns(),
                         &call);
      break;
    case TRESTLE_CALL_ENDED:
      print_payload(happening->answered ? "answer:" : "no answer", happening);
      break;
    case TRESTLE_EVENT:
      print_payload("event:", happening);
      break;
    default:
      break;
  }
  fflush(stdout);
}

/* Sends, and looks at one happening, until there is nothing left of both. */
static void serve(void) {
  uint8_t room[TRESTLE_DATAGRAM_BYTES];
  trestle_transmit out;
  trestle_happening happening;
  for (;;) {
    while (trestle_poll_transmit(device, room, sizeof room, now_ns(), &out)) {
      send_datagram(&out);
    }
    if (!trestle_poll_happening(device, &happening)) {
      return;
    }
    handle(&happening);
  }
}

static void receive_from(const port* at) {
  static uint8_t datagram[65536];
  struct sockaddr_in from;
  socklen_t length = sizeof from;
  const ssize_t size =
      recvfrom(at->socket, datagram, sizeof datagram, MSG_DONTWAIT, (struct sockaddr*)&from, &length);
  if (size >= 0) {
    const trestle_endpoint peer = from_system(&from);
    trestle_on_datagram(device, datagram, (size_t)size, &peer, &at->local, now_ns());
    serve();
  }
}

/* Each 250 ms, a small event, and each fourth time a large one. */
static void send_events(void) {
  static uint8_t count[2];
  count[1] = (uint8_t)(count[1] + 1);
  count[0] = (uint8_t)(count[0] + (count[1] == 0 ? 1 : 0));
  (void)trestle_notify(device, 0, 0x8001, count, sizeof count);
  if (count[1] % 4 == 0 && large_is_free && trestle_subscribers(device, 0, 0x8002) > 0) {
    memset(large, count[1], sizeof large);
    large_is_free = trestle_notify(device, 0, 0x8002, large, sizeof large) != TRESTLE_OK;
  }
  serve();
}

static volatile sig_atomic_t stopped;
static void stop(int signal_number) {
  (void)signal_number;
  stopped = 1;
}

static int milliseconds_until(uint64_t next_event) {
  uint64_t due;
  const uint64_t now = now_ns();
  if (!trestle_deadline(device, &due) || due > next_event) {
    due = next_event;
  }
  return due <= now ? 0 : (int)((due - now) / 1000000U) + 1;
}

static void run(void) {
  uint64_t next_event = now_ns();
  while (!stopped) {
    struct pollfd waiting[PORTS];
    for (size_t i = 0; i < PORTS; ++i) {
      waiting[i].fd = ports[i].socket;
      waiting[i].events = POLLIN;
      waiting[i].revents = 0;
    }
    if (poll(waiting, PORTS, milliseconds_until(next_event)) < 0 && errno != EINTR) {
      return;
    }
    for (size_t i = 0; i < PORTS; ++i) {
      if ((waiting[i].revents & POLLIN) != 0) {
        receive_from(&ports[i]);
      }
    }
    trestle_on_time(device, now_ns());
    serve();
    if (now_ns() >= next_event) {
      next_event += 250000000U;
      send_events();
    }
  }
}

static bool make_device(const char* address, const char* group) {
  trestle_settings settings;
  trestle_default_settings(&settings);
  if (inet_pton(AF_INET, address, settings.own.address) != 1 ||
      (group != NULL && inet_pton(AF_INET, group, settings.multicast.address) != 1)) {
    fprintf(stderr, "not an IPv4 address\n");
    return false;
  }
  settings.seed = now_ns() ^ settings.own.address[3];
  settings.services = services;
  settings.service_count = 1;
  settings.needs = needs;
  settings.need_count = 1;
  trestle_endpoint at = settings.own;
  bool opened = open_port(&ports[UNICAST], &at, &settings.own) &&
                open_port(&ports[MULTICAST], &settings.multicast, &settings.own);
  at.port = SERVICE_PORT;
  opened = opened && open_port(&ports[SERVICE], &at, &settings.own);
  at.port = NEED_PORT;
  opened = opened && open_port(&ports[NEED], &at, &settings.own);
  if (!opened) {
    perror("cannot open the ports");
    return false;
  }
  const trestle_status made = trestle_init(memory, sizeof memory, &limits, &settings, &device);
  if (made != TRESTLE_OK) {
    fprintf(stderr, "cannot make the device: status %d\n", (int)made);
    return false;
  }
  return trestle_offer(device, 0, now_ns()) == TRESTLE_OK &&
         trestle_require(device, 0, now_ns()) == TRESTLE_OK;
}

int main(int argc, char** argv) {
  if (argc < 2) {
    fprintf(stderr, "usage: c_device ADDRESS [GROUP]\n");
    return 2;
  }
  signal(SIGINT, stop);
  signal(SIGTERM, stop);
  if (!make_device(argv[1], argc > 2 ? argv[2] : NULL)) {
    return 1;
  }
  printf("offered; %u bytes of memory\n", (unsigned)sizeof memory);
  fflush(stdout);
  run();
  trestle_shutdown(device, now_ns());
  serve();
  return 0;
}
