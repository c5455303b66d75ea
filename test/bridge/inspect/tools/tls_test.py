"""TLS of `trestle offer` and `trestle call`, beside OpenSSL's s_client and s_server and Python's ssl, which speak
SOME/IP by hand-made bytes.

Usage: tls_test.py TRESTLE
"""
import os
import re
import socket
import ssl
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from tool_commands_test import GROUP, HOST, Running, run
from bare_peer import PATIENCE, Peer

FOLDER = tempfile.TemporaryDirectory()
KEY = "000102030405060708090a0b0c0d0e0f"
PORT = 40402
REQUEST = struct.pack(">HHIHHBBBB", 0x1234, 0x0021, 8 + 2, 0x00AA, 0x0001, 1, 1, 0, 0) + b"\x05\x06"
ANSWER = struct.pack(">HHIHHBBBB", 0x1234, 0x0021, 8 + 2, 0x00AA, 0x0001, 1, 1, 0x80, 0) + b"\x0a\x0b"


def at(name):
    return os.path.join(FOLDER.name, name)


def openssl(*arguments):
    done = subprocess.run(["openssl", *arguments], cwd=FOLDER.name, capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(done.stderr)


def setUpModule():
    curve = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"]
    for root in ("ours", "theirs"):
        openssl("req", "-x509", *curve, "-days", "2", "-subj", f"/CN={root}", "-keyout", f"{root}.key", "-out", f"{root}.pem")
    for host, root in (("server", "ours"), ("client", "ours"), ("stranger", "theirs")):
        openssl("req", *curve, "-subj", f"/CN={host}", "-keyout", f"{host}.key", "-out", f"{host}.csr")
        openssl("x509", "-req", "-days", "2", "-in", f"{host}.csr", "-CA", f"{root}.pem", "-CAkey", f"{root}.key",
                "-CAcreateserial", "-out", f"{host}.pem")
    with open(at("psk.hex"), "w", encoding="ascii") as file:
        file.write(KEY + "\n")


def certificates(host):
    return ["--tls-certificate", at(f"{host}.pem"), "--tls-key", at(f"{host}.key"), "--tls-ca", at("ours.pem")]


PSK = ["--tls-psk-identity", "vehicle", "--tls-psk-key", at("psk.hex")]


def context(host, protocol=ssl.PROTOCOL_TLS_CLIENT):
    result = ssl.SSLContext(protocol)
    result.check_hostname = False
    result.verify_mode = ssl.CERT_REQUIRED
    result.load_verify_locations(at("ours.pem"))
    if host:
        result.load_cert_chain(at(f"{host}.pem"), at(f"{host}.key"))
    return result


def receive_all(stream, size):
    data = b""
    while len(data) < size:
        more = stream.recv(size - len(data))
        if not more:
            raise ConnectionError("ended")
        data += more
    return data


class Offer(unittest.TestCase):
    """Foreign clients of our server."""

    def offer(self, *tls):
        offer = self.enterContext(Running("offer", 1, "0x1234.0x0001", "--method", "0x21=0a0b", "--tcp", *tls))
        self.address = HOST + "1"
        self.port = int(re.search(r"at TCP .*:(\d+)", offer.line_with("offering", of_log=True))[1])
        return offer

    def exchange(self, host):
        with socket.create_connection((self.address, self.port), PATIENCE) as plain:
            with context(host).wrap_socket(plain) as stream:
                stream.sendall(REQUEST)
                return receive_all(stream, len(ANSWER))

    def s_client(self, *arguments):
        """What a server sends to s_client after the request."""
        with subprocess.Popen(["openssl", "s_client", "-quiet", "-connect", f"{self.address}:{self.port}", *arguments],
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as client:
            timer = threading.Timer(PATIENCE, client.kill)
            timer.start()
            try:
                client.stdin.write(REQUEST)
                client.stdin.flush()
                answer = client.stdout.read(len(ANSWER))
            finally:
                client.kill()
                timer.cancel()
            return answer

    def test_answers_those_that_have_a_certificate(self):
        offer = self.offer(*certificates("server"))
        self.assertEqual(self.exchange("client"), ANSWER)
        offer.line_with("0506")
        client = ["-cert", at("client.pem"), "-key", at("client.key"), "-CAfile", at("ours.pem"), "-verify_return_error"]
        for version in ("-tls1_2", "-tls1_3"):
            with self.subTest(version):
                self.assertEqual(self.s_client(*client, version), ANSWER)

    def test_answers_nobody_else(self):
        offer = self.offer(*certificates("server"))
        for host in ("stranger", None):
            with self.subTest(host):
                self.assertRaises(OSError, self.exchange, host)  # ssl.SSLError is one
        with socket.create_connection((self.address, self.port), PATIENCE) as plain:
            plain.sendall(REQUEST)
            try:
                self.assertNotIn(b"\x0a\x0b", plain.recv(100))  # a TLS alert, or nothing
            except ConnectionResetError:
                pass
        self.assertEqual(self.s_client("-tls1_1", "-cipher", "ALL:@SECLEVEL=0"), b"")
        offer.line_with("the TLS handshake failed", of_log=True)
        self.assertFalse(offer.has_printed(0))

    def test_answers_those_that_know_the_key(self):
        self.offer(*PSK)
        known = ["-psk", KEY, "-psk_identity", "vehicle"]
        self.assertEqual(self.s_client(*known, "-tls1_3"), ANSWER)
        self.assertEqual(self.s_client(*known, "-tls1_2", "-cipher", "PSK-AES128-GCM-SHA256"), ANSWER)
        self.assertEqual(self.s_client("-psk", "ff" + KEY[2:], "-psk_identity", "vehicle"), b"")
        self.assertEqual(self.s_client("-psk", KEY, "-psk_identity", "other"), b"")


class Call(unittest.TestCase):
    """Our client of foreign servers."""

    def setUp(self):
        self.peer = self.enterContext(Peer(HOST + "4", GROUP))

    def call(self, *tls, timeout=PATIENCE // 2):
        """Calls while the peer offers the service over TCP."""
        done = threading.Event()

        def offer():
            entry = struct.pack(">BBBBHHII", 1, 0, 0, 0x10, 0x1234, 1, 1 << 24 | 600, 0)
            option = struct.pack(">HBB4sBBH", 9, 0x04, 0, socket.inet_aton(self.peer.address), 0, 0x06, PORT)
            while not done.wait(0.05):
                self.peer.send_sd(GROUP, entry, option)

        offering = threading.Thread(target=offer)
        offering.start()
        try:
            return run("call", 2, "0x1234.0x0001", "0x21", "0506", "--timeout", str(timeout), *tls)
        finally:
            done.set()
            offering.join()

    def serve(self, host):
        listener = self.enterContext(socket.create_server((self.peer.address, PORT)))
        # Else the thread in accept() keeps it open.
        self.addCleanup(listener.shutdown, socket.SHUT_RDWR)

        def serve():
            while True:
                try:
                    plain, _ = listener.accept()
                except OSError:
                    return
                try:
                    with context(host, ssl.PROTOCOL_TLS_SERVER).wrap_socket(plain, server_side=True) as stream:
                        head = receive_all(stream, 16)
                        payload = receive_all(stream, int.from_bytes(head[4:8], "big") - 8)
                        self.requests.append(payload)
                        stream.sendall(head[:14] + b"\x80\x00" + b"\x0a\x0b")
                        stream.recv(1)
                except OSError:
                    pass

        self.requests = []
        serving = threading.Thread(target=serve, daemon=True)
        serving.start()

    def test_a_server_with_a_certificate_answers(self):
        self.serve("server")
        done = self.call(*certificates("client"))
        self.assertEqual((done.returncode, done.stdout), (0, "0a0b\n"), done.stderr)
        self.assertEqual(self.requests, [b"\x05\x06"])

    def test_a_server_with_another_certificate_is_told_nothing(self):
        self.serve("stranger")
        for timeout in 5, 15, 45:  # it tries until then, and on a slow machine may not have got as far
            done = self.call(*certificates("client"), timeout=timeout)
            if "certificate verify failed" in done.stderr:
                break
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("certificate verify failed", done.stderr)
        self.assertEqual(self.requests, [])

    def test_a_server_that_knows_the_key_answers(self):
        server = subprocess.Popen(["openssl", "s_server", "-quiet", "-accept", f"{self.peer.address}:{PORT}", "-nocert", "-psk",
                                   KEY, "-psk_identity", "vehicle"],
                                  stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

        def answer():
            head = server.stdout.read(16)
            if len(head) == 16:
                server.stdout.read(int.from_bytes(head[4:8], "big") - 8)
                server.stdin.write(head[:4] + (10).to_bytes(4, "big") + head[8:14] + b"\x80\x00" + b"\x0a\x0b")
                server.stdin.flush()

        # With -quiet it does not say when it listens.
        until = time.monotonic() + PATIENCE
        listens = False
        while not listens and time.monotonic() < until:
            with socket.socket() as probe:
                listens = probe.connect_ex((self.peer.address, PORT)) == 0
            time.sleep(0.05)
        answering = threading.Thread(target=answer)
        answering.start()
        try:
            done = self.call(*PSK)
        finally:
            server.kill()
            answering.join()
            server.wait()
            server.stdin.close()
            server.stdout.close()
        self.assertEqual((done.returncode, done.stdout), (0, "0a0b\n"), done.stderr)

    def test_options_that_contradict_themselves_are_refused(self):
        done = run("call", 2, "0x1234.0x0001", "0x21", "0506", *PSK, *certificates("client"))
        self.assertEqual(done.returncode, 2)
        self.assertIn("either certificates or a key that both ends know, not both", done.stderr)


if __name__ == "__main__":
    unittest.main()
