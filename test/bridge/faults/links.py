"""The network of the bridge, or of its peer, goes away and comes back."""
import subprocess

from fault_world import ALL_FLOWS
from lab import ADDRESS
from scenario import scenario


def ip(host, command):
    subprocess.run(["ip", "-n", host, *command.split()], check=True, capture_output=True)


# TCP sends again what was lost after 0.2 s, and then after twice the time before: what was away for so long may take as
# long again. A call that was begun meanwhile has a timeout of one second.
def tcp_patience(away_s):
    return 2.0 + 2 * away_s


@scenario("link-down", 1, "the interface of the bridge goes down and up")
def link_down(world):
    world.honest(*ALL_FLOWS)
    away = world.scale.attack_s

    def fault():
        ip("car", "link set eth0 down")
        world.pass_time(away, "the link is down")
        ip("car", "link set eth0 up")
    world.hold_after(fault, again_tcp_s=tcp_patience(away))


@scenario("link-flaps", 1, "the interface of the bridge goes down and up ten times, for 0.1 s each")
def link_flaps(world):
    world.honest(*ALL_FLOWS)

    def fault():
        for _ in range(10):
            ip("car", "link set eth0 down")
            world.pass_time(0.1, "the link is down")
            ip("car", "link set eth0 up")
            world.pass_time(0.1, "the link is up")
    world.hold_after(fault, again_tcp_s=tcp_patience(1))


@scenario("peer-link-down", 1, "the interface of the peer goes down and up")
def peer_link_down(world):
    world.honest(*ALL_FLOWS)
    away = world.scale.attack_s

    def fault():
        ip("honest", "link set eth0 down")
        world.pass_time(away, "the link is down")
        ip("honest", "link set eth0 up")
    world.hold_after(fault, again_tcp_s=tcp_patience(away))


@scenario("cable-unplugged", 1, "the switch is gone for a while; both interfaces stay up")
def cable(world):
    world.honest(*ALL_FLOWS)
    away = world.scale.attack_s + 2  # longer than what was offered lives

    def fault():
        ip("switch", "link set car nomaster")
        world.pass_time(away, "unplugged")
        ip("switch", "link set car master switch")
    world.hold_after(fault, again_tcp_s=tcp_patience(away))


@scenario("address-away", 2, "the address of the bridge is removed and added again")
def address_away(world):
    world.honest(*ALL_FLOWS)
    away = world.scale.attack_s

    def fault():
        ip("car", f"address del {ADDRESS['car']}/16 dev eth0")
        world.pass_time(away, "without the address")
        ip("car", f"address add {ADDRESS['car']}/16 dev eth0")
    world.hold_after(fault, again_tcp_s=tcp_patience(away))


@scenario("address-anew", 2, "all addresses of the bridge's interface are removed and added again")
def all_addresses(world):
    world.honest(*ALL_FLOWS)
    away = world.scale.attack_s

    def fault():
        ip("car", "address flush dev eth0")
        world.pass_time(away, "without addresses")
        ip("car", f"address add {ADDRESS['car']}/16 dev eth0")
    world.hold_after(fault, again_tcp_s=tcp_patience(away))


@scenario("interface-anew", 2, "the interface of the bridge is deleted, and another one of the same name has its address")
def interface_anew(world):
    world.honest(*ALL_FLOWS)
    away = world.scale.attack_s

    def fault():
        ip("car", "link del eth0")
        world.pass_time(away, "without the interface")
        subprocess.run("ip link add eth0 netns car type veth peer name car netns switch".split(), check=True)
        ip("switch", "link set car master switch up")
        ip("car", f"address add {ADDRESS['car']}/16 dev eth0")
        ip("car", "link set eth0 up")
    world.hold_after(fault, again_tcp_s=tcp_patience(away))
