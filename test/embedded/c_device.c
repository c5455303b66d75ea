/* A device in C, linked with nothing but libgcc and memory_functions.cpp, and never run: what it is told
 * comes from, and what it has to say goes to, variables that the compiler knows nothing of. */
#include "trestle.h"

#define LIMITS 1, 1, 1, 4, 4, 1, 1, 1, 1, 8, 8, 4, 512, 1, 8192, 1
static const trestle_limits limits = {LIMITS};
static uint64_t memory[TRESTLE_MEMORY_BYTES(LIMITS) / 8];
static uint8_t room[TRESTLE_DATAGRAM_BYTES];
static uint8_t received[1500];
static volatile size_t received_bytes;
static volatile size_t sent_bytes;
static volatile uint64_t clock_ns;

static const trestle_method methods[] = {{0x0001, TRESTLE_REQUEST_RESPONSE}};
static const trestle_event events[] = {{0x8001, {1}}};
static const uint16_t eventgroups[] = {1};
static const trestle_service services[] = {{.service = 0x1234,
                                            .instance = 1,
                                            .major = 1,
                                            .port = 30501,
                                            .methods = methods,
                                            .method_count = 1,
                                            .events = events,
                                            .event_count = 1,
                                            .eventgroups = eventgroups,
                                            .eventgroup_count = 1}};
static const trestle_need needs[] = {{.service = 0x4321,
                                      .instance = 1,
                                      .major = 1,
                                      .port = 30502,
                                      .eventgroups = eventgroups,
                                      .eventgroup_count = 1}};

static void handle(trestle_device* device, const trestle_happening* what) {
  uint32_t call = 0;
  switch (what->kind) {
    case TRESTLE_REQUEST:
      (void)trestle_respond(device, &what->request, what->payload, what->size);
      break;
    case TRESTLE_SERVICE_AVAILABLE:
      (void)trestle_call(device, 0, 0x0001, received, 4, 1000000000U, clock_ns, &call);
      break;
    case TRESTLE_EVENT:
      (void)trestle_notify(device, 0, 0x8001, what->payload, what->size);
      break;
    default:
      break;
  }
}

int main(void) {
  trestle_device* device = NULL;
  trestle_settings settings;
  trestle_default_settings(&settings);
  settings.own = (trestle_endpoint){.address = {192, 0, 2, 10}, .port = 30490};
  settings.seed = clock_ns;
  settings.services = services;
  settings.service_count = 1;
  settings.needs = needs;
  settings.need_count = 1;
  if (trestle_init(memory, sizeof memory, &limits, &settings, &device) != TRESTLE_OK ||
      trestle_offer(device, 0, clock_ns) != TRESTLE_OK ||
      trestle_require(device, 0, clock_ns) != TRESTLE_OK) {
    return 1;
  }
  for (;;) {
    const trestle_endpoint from = {.address = {192, 0, 2, 11}, .port = 30490};
    trestle_transmit out;
    trestle_happening what;
    trestle_on_datagram(device, received, received_bytes, &from, &settings.own, clock_ns);
    trestle_on_time(device, clock_ns);
    for (;;) {
      while (trestle_poll_transmit(device, room, sizeof room, clock_ns, &out)) {
        sent_bytes = sent_bytes + out.size;
      }
      if (!trestle_poll_happening(device, &what)) {
        break;
      }
      handle(device, &what);
    }
  }
}
