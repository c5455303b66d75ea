"""Programs are killed, or stopped and continued: the bridge, its SOME/IP peer, the ROS node."""
from fault_world import ALL_FLOWS, at_most
from lab import ADDRESS
from links import ip
from scenario import scenario

# A ROS node that is found: DDS's participants tell of themselves every 3 s, and at once to whom they hear first.
DDS_AGAIN_S = 4.0
STOPPED_S = 4.0  # longer than the TTL of what was offered and subscribed to (3 s)


@scenario("bridge-killed", 3, "the bridge is killed (SIGKILL) and started again")
def bridge_killed(world):
    world.honest(*ALL_FLOWS)

    def fault():
        world.kill(world.car)
        world.pass_time(1, "without the bridge")
        world.car = world.again(world.car)
    world.hold_after(fault, again_s=DDS_AGAIN_S, same_bridge=False)


@scenario("bridge-stopped", 3, "the bridge is stopped (SIGSTOP) for longer than its offers live, and goes on")
def bridge_stopped(world):
    world.honest(*ALL_FLOWS)
    # What DDS keeps for its readers, and what TCP has in its buffers, comes at once and late.
    world.hold_after(lambda: world.stop_and_go(world.car, STOPPED_S), again_s=DDS_AGAIN_S)


@scenario("peer-killed", 3, "the SOME/IP peer is killed (SIGKILL) and started again")
def peer_killed(world):
    world.honest(*ALL_FLOWS)

    def fault():
        world.kill(world.honest_end)
        world.pass_time(1, "without the peer")
        world.honest_end = world.again(world.honest_end)
    world.hold_after(fault)


@scenario("peer-killed-for-long", 3, "the same, but the peer comes back after its subscriptions have ended")
def peer_killed_for_long(world):
    world.honest(*ALL_FLOWS)

    def fault():
        world.kill(world.honest_end)
        world.pass_time(STOPPED_S, "without the peer")
        world.honest_end = world.again(world.honest_end)
    world.hold_after(fault)


@scenario("peer-stopped", 3, "the SOME/IP peer is stopped (SIGSTOP) for longer than its offers live, and goes on")
def peer_stopped(world):
    world.honest(*ALL_FLOWS)
    world.hold_after(lambda: world.stop_and_go(world.honest_end, STOPPED_S))


@scenario("node-killed", 4, "the ROS node is killed (SIGKILL), without a word to DDS, and started again")
def node_killed(world):
    world.honest(*ALL_FLOWS)

    def fault():
        world.kill(world.car_end)
        world.pass_time(1, "without the node")
        world.car_end = world.again(world.car_end)
    world.hold_after(fault, again_s=DDS_AGAIN_S)


@scenario("node-stopped", 4, "the ROS node is stopped (SIGSTOP) and goes on")
def node_stopped(world):
    world.honest(*ALL_FLOWS)
    world.hold_after(lambda: world.stop_and_go(world.car_end, STOPPED_S), again_s=DDS_AGAIN_S)


@scenario("node-lost", 4, "the network between the bridge and the ROS node is down; in full until the node is forgotten")
def node_lost(world):
    world.honest(*ALL_FLOWS, interface=ADDRESS["car"], dds_at="bystander")
    lease_s = 20  # of the node

    def fault():
        ip("bystander", "link set eth0 down")
        world.pass_time(world.scale.attack_s if world.scale.short else lease_s + 5, "without DDS")
        if not world.scale.short:
            there = world.counters_of(world.car)["route /events_out to SOME/IP"]["publishers"]
            world.figures.append(at_most("publishers that the bridge still sees", there, 0))
        ip("bystander", "link set eth0 up")
    world.hold_after(fault, again_s=DDS_AGAIN_S)


@scenario("second-bridge-killed", 3, "of two bridges between two DDS domains the one that subscribes is killed")
def second_killed(world):
    other = world.two_bridges("events_out", "clouds_out", "clouds_out_tcp")

    def fault():
        world.kill(other)
        world.pass_time(1, "without the bridge")
        world.again(other)
    world.hold_after(fault, again_s=DDS_AGAIN_S)


@scenario("second-bridge-stopped", 3, "the same one is stopped for longer than its subscriptions live, and goes on")
def second_stopped(world):
    other = world.two_bridges("events_out", "clouds_out", "clouds_out_tcp")
    world.hold_after(lambda: world.stop_and_go(other, STOPPED_S), again_s=DDS_AGAIN_S)


@scenario("first-bridge-killed", 3, "of two bridges between two DDS domains the one that offers is killed")
def first_killed(world):
    world.two_bridges("events_out", "clouds_out", "clouds_out_tcp")

    def fault():
        world.kill(world.car)
        world.pass_time(1, "without the bridge")
        world.car = world.again(world.car)
    world.hold_after(fault, again_s=DDS_AGAIN_S, same_bridge=False)
