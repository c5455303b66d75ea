#include "someip/net/tcp_places.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace trestle::someip {
namespace {

using namespace std::chrono_literals;

constexpr bool silent = true;
constexpr bool spoke = true;

TcpPlace place(std::uint8_t host, std::uint16_t port, bool is_silent, bool has_spoken, int second) {
  return {.own = {IpAddress::v4(10, 0, 0, 1), 30501},
          .client = {IpAddress::v4(10, 0, 0, host), port},
          .spoke = has_spoken,
          .silent = is_silent,
          .last = std::chrono::steady_clock::time_point{std::chrono::seconds{second}}};
}

/// The port of the client that gives way to one of an address that has `own`; 0: nobody does.
int gives_way(const std::vector<TcpPlace>& places, std::size_t own, std::vector<int> in_use = {}) {
  const auto found = who_gives_way(
      places, own, [&](const TcpPlace& one) { return std::ranges::count(in_use, one.client.port) > 0; });
  return found ? found->client.port : 0;
}

TEST(TcpPlaces, OneOfTheAddressWithTheMostGivesWay) {
  const std::vector places{place(2, 1, !silent, spoke, 5), place(3, 2, !silent, spoke, 9),
                           place(3, 3, !silent, spoke, 8), place(4, 4, silent, !spoke, 1)};
  EXPECT_EQ(gives_way(places, 0), 3) << "that of the two which spoke the longest ago";
  EXPECT_EQ(gives_way(places, 0, {3}), 2) << "one that is not in use";
  EXPECT_EQ(gives_way(places, 0, {2, 3}), 2) << "if all are, the one that spoke last";
}

TEST(TcpPlaces, AmongEqualsOneThatWasSilent) {
  const std::vector places{place(2, 1, !silent, !spoke, 3), place(3, 2, silent, spoke, 1),
                           place(4, 3, silent, spoke, 2), place(5, 4, silent, !spoke, 3)};
  EXPECT_EQ(gives_way(places, 0), 4) << "rather one that never spoke";
  EXPECT_EQ(gives_way(places, 0, {4}), 2) << "then the one that spoke the longest ago";
  EXPECT_EQ(gives_way(places, 0, {2, 3, 4}), 0) << "those in use stay";
  EXPECT_EQ(gives_way(places, 1, {4}), 0) << "who has one takes it from nobody who spoke";
  EXPECT_EQ(gives_way(places, 1), 4) << "but from one that never did";
  EXPECT_EQ(gives_way({}, 0), 0);
}

TEST(TcpPlaces, OneWhoseClientDoesNotRead) {
  std::vector places{place(2, 1, silent, !spoke, 1), place(3, 2, !silent, spoke, 5),
                     place(4, 3, !silent, spoke, 4)};
  places[1].unread = true;
  EXPECT_EQ(gives_way(places, 0, {2, 3}), 2) << "even if it is in use";
  EXPECT_EQ(gives_way(places, 1, {2, 3}), 2);
  places.push_back(place(4, 4, !silent, spoke, 9));
  EXPECT_EQ(gives_way(places, 0), 3) << "rather one of the address with the most";
}

}  // namespace
}  // namespace trestle::someip
