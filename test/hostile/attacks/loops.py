"""Bridges that close a ring: what one sends, another brings back."""
import flows
from figures import Figure, at_least, at_most, holds
from lab import ADDRESS, CARS, Failed
from scenario import scenario
from world import route

STRING = "std_msgs/msg/String"
COUNT = 10
START_S = 6  # more than a bridge waits for another one
LOOP_WORDS = "seems to loop"
OUT, IN = "dds_to_someip", "someip_to_dds"


def out(topic, service, port, more=""):
    return route(topic, service, OUT, port, STRING, more)


def back(topic, service):
    return route(topic, service, IN, None, STRING)


def method(service, server, port=None, name="/actuate"):
    where = f", port: {port}, offer: always" if port else ""
    return (f"  - {{ros_service: {name}, type: std_srvs/srv/SetBool, server: {server}, service: {service}, instance: 1, "
            f"method: 1{where}}}\n")


def _start(world, bridges, kind="routes"):
    """Bridges in the car, each at an address of its own: (what is in its file, its DDS domain)."""
    return [world.bridge("car", f"bridge-{number + 1}", f"{kind}:\n{body}", domain, address=CARS[number])
            for number, (body, domain) in enumerate(bridges)]


def _burn():
    while True:
        pass


def _start_again(world, bodies, kind, started):
    """Starts each of two bridges again and again, beside a load that makes their discovery slow."""
    bridges = _start(world, [(body, 80) for body in bodies], kind)
    world.pass_time(4, "bridges find each other")
    ends = started()
    load = [world.lab.fork("car", _burn) for _ in range(4)]
    for number in range(_starts(world)):
        again = 1 - number % 2
        bridges[again].stop()
        world.lab.programs.remove(bridges[again])
        bridges[again] = world.bridge("car", f"bridge-{again + 1}", f"{kind}:\n{bodies[again]}", 80, address=CARS[again])
        world.pass_time(START_S, f"start {number + 1}")
    for child in load:
        world.lab.end(child)
    return ends


def _starts(world):
    return 4 if world.scale.short else 16


def _meanwhile(world, rate):
    """How many messages there are while bridges are started."""
    return int((_starts(world) * START_S + 1) * rate)


def _await(world, arrived):
    """Waits for what has to come, if it comes at all: its figure says so."""
    try:
        world.wait(arrived, "")
    except Failed:
        world.check()


def _strings(world, bridges, parts=("chatter=read:/chatter:string",), relay="", readers=2, subscriptions=0, domain=80,
             count=COUNT, rate=5):
    """Publishes Strings on /chatter and gives what is read in the same domain, beside those that were published.

    readers: of /chatter, bridges and ours. subscriptions: of bridges, which have to be there before."""
    _start(world, bridges)
    if relay:
        world.end("honest", "relay", "peer", "10.84.0.2", relay)
    reader = world.end("car", "reader", "dds", domain, *parts)
    world.pass_time(2 if world.scale.short else 3, "bridges find each other")
    _await(world, lambda: sum(one.text().count("subscribed to eventgroup") for one in world.lab.programs) >= subscriptions)
    writer = world.end("car", "writer", "dds", domain, f"chatter=publish:/chatter:string:0:{rate}:reliable:{count}:{readers}")
    world.wait(lambda: len(flows.read(writer.out)[0]["chatter"].sent) == count, "nobody reads what is published")
    sent = set(flows.read(writer.out)[0]["chatter"].sent)
    _await(world, lambda: sent <= {stamp for stamp, _ in flows.read(reader.out)[0]["chatter"].received})
    world.pass_time(2 if world.scale.short else 5, "what comes back")
    seen = flows.read(reader.out)[0]
    came = [stamp for stamp, _ in seen["chatter"].received]
    world.figures.append(at_least("Strings that came", len(set(came) & sent), count))
    return len(came) - len(set(came) & sent), seen, sent


def _no_more(world, extra):
    world.figures.append(at_most("Strings more than published", extra, 0))


def _judge_bounded(world, extra, before_found=0):
    world.figures.append(Figure("Strings more than published", extra))
    told = [program.text() for program in world.lab.programs if LOOP_WORDS in program.text()]
    # One String in the ring is a String that never ends; told of, or not there at all.
    world.figures.append(holds(f'nothing, or told of: "{LOOP_WORDS}"', extra == 0 or told))
    rate = max(0, extra - before_found) / (4 if world.scale.short else 7)
    world.figures.append(at_most("Strings a second in the ring", rate, 200, "/s"))


@scenario("loop-two-bridges", 1, "two bridges in one DDS domain carry a String in a ring")
def two(world):
    extra, _, _ = _strings(world, [(out("/chatter", 0x4101, 40101), 80), (back("/chatter", 0x4101), 80)])
    _no_more(world, extra)


@scenario("loop-three-bridges", 1, "three bridges, two topics and two services in a ring")
def three(world):
    extra, seen, _ = _strings(world, [(out("/chatter", 0x4101, 40101), 80),
                                      (back("/other", 0x4101) + back("/chatter", 0x4102), 80),
                                      (out("/other", 0x4102, 40102), 80)],
                              ("chatter=read:/chatter:string", "other=read:/other:string"))
    _no_more(world, extra + max(0, len(seen["other"].received) - COUNT))


@scenario("loop-over-both-networks", 1, "two pairs of bridges between two DDS domains, a ring over both networks")
def both(world):
    extra, _, _ = _strings(world, [(out("/chatter", 0x4101, 40101), 80), (back("/chatter", 0x4101), 81),
                                   (out("/chatter", 0x4102, 40102), 81), (back("/chatter", 0x4102), 80)])
    _no_more(world, extra)


@scenario("loop-patterns", 1, "two bridges with patterns, each with the lock file of the other")
def patterns(world):
    folder = world.lab.folder
    # The id of /chatter is chosen by its name, so it is known to both from the start.
    for number in 1, 2:
        (folder / f"{number}.lock").write_text(
            "version: 1\ntopics:\n  - {service: 0x6001, topic: /chatter, type: std_msgs/msg/String}\n", encoding="utf-8")
    ways = ["direction: dds_to_someip, services: 0x6000-0x6fff, port: 40060", "direction: someip_to_dds"]
    for number, way in enumerate(ways, 1):
        world.bridge("car", f"bridge-{number}",
                     f"lock_file: {folder}/{number}.lock\npatterns:\n  - {{topics: /**, {way}}}\n", 80, address=CARS[number])
    extra, _, _ = _strings(world, [])
    _no_more(world, extra)


@scenario("loop-another-maker", 1, "a ring that something else closes in SOME/IP: bounded, and told of")
def foreign(world):
    extra, _, _ = _strings(world, [(out("/chatter", 0x4101, 40101), 80), (back("/chatter", 0x4102), 80)],
                           relay="relay=relay:0x4101:0x4102")
    _judge_bounded(world, extra)


def _old_bridge(world, count, rate):
    world.bridge("car", "bridge", "routes:\n" + back("/chatter", 0x4101), 80, interface=ADDRESS["car"])
    gateway = world.end("honest", "old", "old", ADDRESS["honest"] + ":80", "old=event:/chatter:0x4101")
    _strings(world, [], subscriptions=1, domain="80,all", count=count, rate=rate)
    _judge_bounded(world, len(flows.read(gateway.out)[0]["old"].sent) - count)


@scenario("loop-old-bridge", 1, "a bridge that says nothing of itself takes the topic out again: bounded, and told of")
def old(world):
    _old_bridge(world, COUNT, 5)


@scenario("loop-old-bridge-burst", 1, "the same with 200 Strings at once")
def old_burst(world):
    _old_bridge(world, 200, 2000)


@scenario("loop-old-bridge-100hz", 1, "the same with 300 Strings, 100 a second")
def old_often(world):
    _old_bridge(world, 300, 100)


@scenario("loop-two-hosts", 1, "a ring that is closed on two other hosts, in DDS and in SOME/IP: bounded, and told of")
def two_hosts(world):
    world.bridge("car", "bridge", "routes:\n" + back("/chatter", 0x4101), 80, interface=ADDRESS["car"])
    gateway = world.end("honest", "old", "old", ADDRESS["honest"] + ":80", "old=event:/chatter:0x4102")
    world.end("second", "relay", "peer", ADDRESS["second"], "relay=relay:0x4102:0x4101")
    _strings(world, [], subscriptions=1, domain="80,all")
    # 500 before it is looked at, and 500 before it is put on trial.
    _judge_bounded(world, len(flows.read(gateway.out)[0]["old"].sent) - COUNT, before_found=1100)


@scenario("loop-old-bridge-calls", 1, "the same with a service, called once by SOME/IP: bounded, and told of")
def old_calls(world):
    bridge = world.bridge("car", "bridge", "methods:\n" + method(0x4201, "someip"), 80, interface=ADDRESS["car"])
    server = world.end("car", "server", "dds", "80,all", "actuate=answer:/actuate")
    world.end("honest", "old", "old", ADDRESS["honest"] + ":80", "old=method:0x4201:/actuate")
    world.pass_time(3 if world.scale.short else 4, "bridges find each other")
    client = world.lab.start("second", "call", world.trestle, "call", "--address", ADDRESS["second"], "0x4201.1", "1", "01")
    client.process.wait(60)
    world.lab.programs.remove(client)
    world.pass_time(2 if world.scale.short else 6, "what comes back")
    asked = len(flows.read(server.out)[0]["actuate"].asked)
    world.figures.append(at_least("requests at the server", asked, 1))
    # 100 before it is put on trial, 10 a second from then on.
    world.figures.append(at_most("requests at the server of one call", asked, 200))
    world.figures.append(holds(f'one, or told of: "{LOOP_WORDS}"', asked == 1 or LOOP_WORDS in bridge.text()))


@scenario("two-side-by-side", 1, "two bridges on purpose, split by service: all is carried, once")
def beside(world):
    far = world.end("car", "far", "dds", 81, "one=read:/one:string", "two=read:/two:string")
    _, _, sent = _strings(world, [(out("/chatter", 0x4101, 40101), 80), (out("/chatter", 0x4103, 40103), 80),
                                  (back("/one", 0x4101) + back("/two", 0x4103), 81)], readers=3, subscriptions=2)
    _await(world, lambda: all(sent <= {stamp for stamp, _ in flows.read(far.out)[0][name].received} for name in ("one", "two")))
    seen = flows.read(far.out)[0]
    for name in "one", "two":
        came = [stamp for stamp, _ in seen[name].received]
        world.figures.append(at_least(f"Strings by bridge {name}", len(set(came) & sent), COUNT))
        _no_more(world, len(came) - len(set(came) & sent))
    world.figures.append(holds("no word of a loop", not any(LOOP_WORDS in one.text() for one in world.lab.programs)))


def _calls(world, calls, parts):
    """Calls the service of the car, and counts what its server is asked."""
    server = world.end("car", "server", "dds", 80, "actuate=answer:/actuate")
    world.pass_time(3 if world.scale.short else 4, "bridges find each other")
    client = world.end(*parts)
    world.wait(lambda: len(flows.read(client.out)[0]["calls"].calls) >= calls, "the calls do not end")
    world.pass_time(2 if world.scale.short else 4, "what comes back")
    asked = len(flows.read(server.out)[0]["actuate"].asked)
    world.figures.append(at_most("requests at the server more than calls", max(0, asked - calls), 0))
    answered = sum(1 for _, answer in flows.read(client.out)[0]["calls"].calls[:calls] if answer)
    world.figures.append(at_least("calls answered", answered, calls))


@scenario("loop-service", 1, "two bridges carry a service in a ring, a ROS client calls once")
def service(world):
    _start(world, [(method(0x4201, "ros", 40201), 80), (method(0x4201, "someip"), 80)], "methods")
    _calls(world, 1, ("car", "client", "dds", 80, "calls=ask:/actuate:10:1"))


@scenario("loop-service-called", 1, "the same ring, called once by SOME/IP")
def called(world):
    _start(world, [(method(0x4201, "ros", 40201), 80), (method(0x4201, "someip"), 80)], "methods")
    server = world.end("car", "server", "dds", 80, "actuate=answer:/actuate")
    world.pass_time(3 if world.scale.short else 4, "bridges find each other")
    # A payload of one byte: true.
    client = world.lab.start("honest", "call", world.trestle, "call", "--address", "10.84.0.2", "0x4201.1", "1", "01",
                             "--timeout", "30")
    client.process.wait(60)
    world.lab.programs.remove(client)
    world.pass_time(2 if world.scale.short else 4, "what comes back")
    asked = len(flows.read(server.out)[0]["actuate"].asked)
    world.figures.append(at_most("requests at the server more than calls", max(0, asked - 1), 0))
    world.figures.append(at_least("requests at the server", asked, 1))


@scenario("loop-starts", 1, "the ring of a String, 50 a second, while its bridges are started again and again beside a load")
def starts(world):
    count = _meanwhile(world, 50)
    reader = world.end("car", "reader", "dds", 80, "chatter=read:/chatter:string")
    writer = _start_again(world, [out("/chatter", 0x4101, 40101), back("/chatter", 0x4101)], "routes", lambda: world.end(
        "car", "writer", "dds", 80, f"chatter=publish:/chatter:string:0:50:reliable:{count}:2"))
    world.wait(lambda: len(flows.read(writer.out)[0]["chatter"].sent) == count, "nobody reads what is published")
    world.pass_time(2, "what comes back")
    came = [stamp for stamp, _ in flows.read(reader.out)[0]["chatter"].received]
    world.figures.append(at_least("Strings that came", len(set(came)), count))
    _no_more(world, len(came) - len(set(came)))


@scenario("loop-starts-calls", 1, "the ring of a service, 50 calls a second, while its bridges are started again and again")
def starts_calls(world):
    count = _meanwhile(world, 50)
    server = world.end("car", "server", "dds", 80, "actuate=answer:/actuate")
    client = _start_again(world, [method(0x4201, "ros", 40201), method(0x4201, "someip")], "methods",
                          lambda: world.end("car", "client", "dds", 80, f"calls=ask:/actuate:50:{count}"))
    world.wait(lambda: len(flows.read(client.out)[0]["calls"].calls) == count, "the calls do not end")
    world.pass_time(2, "what comes back")
    asked = len(flows.read(server.out)[0]["actuate"].asked)
    world.figures.append(at_most("requests at the server more than calls", max(0, asked - count), 0))
    answered = sum(1 for _, answer in flows.read(client.out)[0]["calls"].calls if answer)
    world.figures.append(at_least("calls answered", answered, count))
