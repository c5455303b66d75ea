"""A browser for tests of pages: Chromium without a window, by the WebDriver protocol (W3C) of Debian's chromium-driver.

Nothing of Python's packages is needed. The browser reaches this machine's loopback addresses and nothing else."""
import base64
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

PATIENCE = 60
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # the key of an element, by the protocol
KEYS = {"TAB": "\ue004", "ENTER": "\ue007", "DOWN": "\ue015", "UP": "\ue013", "LEFT": "\ue012", "RIGHT": "\ue014",
        "HOME": "\ue011", "END": "\ue010", "SHIFT": "\ue008", "CONTROL": "\ue009", "BACKSPACE": "\ue003", "SPACE": "\ue00d"}


def needs_browser():
    """Ends the program where there is none: as skipped, or as failed where it is required."""
    if shutil.which("chromium") and shutil.which("chromedriver"):
        return
    required = {"1", "chromium"} & set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(","))
    print(f"{'missing' if required else 'skipped'}: chromium and chromium-driver, of Debian")
    sys.exit(1 if required else 77)


class Browser:
    """One window. Use as a context manager."""

    def __init__(self, width=1500, height=1100, dark=False):
        self.folder = tempfile.TemporaryDirectory(prefix="trestle-browser-")
        self.downloads = os.path.join(self.folder.name, "downloads")
        os.mkdir(self.downloads)
        self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        for line in self.driver.stdout:
            if started := re.search(r"started successfully on port (\d+)", line):
                break
        self.url = f"http://127.0.0.1:{started[1]}/session"
        arguments = [
            "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--disable-extensions",
            "--disable-background-networking", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
            f"--user-data-dir={self.folder.name}/profile", f"--window-size={width},{height}", "--force-device-scale-factor=1",
            *(["--force-dark-mode", "--blink-settings=preferredColorScheme=0"] if dark else []),
        ]
        options = {"binary": shutil.which("chromium"), "args": arguments, "prefs": {"download.default_directory": self.downloads}}
        wanted = {"capabilities": {"alwaysMatch": {
            "browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}}}
        # On a slow machine chromedriver gives up waiting for Chromium after a minute, and so do we.
        session = self.until_done(lambda: self.ask("POST", "", wanted, 2 * PATIENCE), 3 * PATIENCE)
        self.url += "/" + session["sessionId"]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self.ask("DELETE", "")
        except (OSError, RuntimeError):
            pass
        self.driver.terminate()
        self.driver.wait(PATIENCE)
        self.driver.stdout.close()
        self.folder.cleanup()

    @staticmethod
    def until_done(act, patience=PATIENCE):
        """Does what the browser may refuse at first, until it does not."""
        end = time.monotonic() + patience
        while True:
            try:
                return act()
            except RuntimeError:
                if time.monotonic() > end:
                    raise
            time.sleep(0.05)

    def ask(self, method, path, body=None, patience=PATIENCE):
        request = urllib.request.Request(self.url + path, method=method, headers={"Content-Type": "application/json"},
                                         data=None if body is None else json.dumps(body).encode())
        try:
            with urllib.request.urlopen(request, timeout=patience) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(json.load(error)["value"]["message"]) from None

    def open(self, url):
        self.ask("POST", "/url", {"url": url})

    def run(self, script, *arguments):
        """What the body of a function returns in the page."""
        return self.ask("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def find(self, css):
        return self.ask("POST", "/element", {"using": "css selector", "value": css})[ELEMENT]

    def click(self, css):
        """What is found may be drawn anew, or moved, before it is clicked."""
        self.until_done(lambda: self.ask("POST", f"/element/{self.find(css)}/click", {}))

    def keys(self, *presses):
        """To what has the focus. A key's name, or text; "SHIFT+TAB" holds the first down."""
        actions = []
        for press in presses:
            held, _, last = press.rpartition("+") if press.split("+")[0] in KEYS else ("", "", press)
            characters = [KEYS[last]] if last in KEYS else list(last)
            actions += [{"type": "keyDown", "value": KEYS[held]}] if held else []
            for character in characters:
                actions += [{"type": "keyDown", "value": character}, {"type": "keyUp", "value": character}]
            actions += [{"type": "keyUp", "value": KEYS[held]}] if held else []
        self.ask("POST", "/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": actions}]})

    def text(self, css):
        return self.run("const element = document.querySelector(arguments[0]); return element ? element.textContent : ''", css)

    def wait(self, what, script, *arguments):
        """Until the script returns something true, which is returned."""
        end = time.monotonic() + PATIENCE
        while True:
            value = self.run(script, *arguments)
            if value:
                return value
            if time.monotonic() > end:
                raise AssertionError(f"in vain: {what}\n{self.text('body')}\n{self.log()}")
            time.sleep(0.05)

    def wait_for_text(self, css, text):
        self.wait(f"'{text}' in {css}", "const element = document.querySelector(arguments[0]);"
                  "return element !== null && element.textContent.includes(arguments[1])", css, text)

    def drop(self, files):
        """Files by name and text, as somebody drops them on the page."""
        self.run("""
            const data = new DataTransfer();
            for (const [name, text] of Object.entries(arguments[0])) data.items.add(new File([text], name));
            document.body.dispatchEvent(new DragEvent("drop", {dataTransfer: data, bubbles: true, cancelable: true}));
        """, files)

    def downloaded(self, name):
        """The path of a file that the page has saved. Chromium makes it at the beginning, and moves what it has there at the end."""
        path = os.path.join(self.downloads, name)
        end = time.monotonic() + PATIENCE
        while not os.path.exists(path) or os.path.getsize(path) == 0:
            if time.monotonic() > end:
                raise AssertionError(f"not saved: {name}; there are {os.listdir(self.downloads)}")
            time.sleep(0.05)
        return path

    def log(self):
        """What the page wrote to its console since the last time: errors, and what its policy forbade."""
        return [entry["message"] for entry in self.ask("POST", "/se/log", {"type": "browser"}) if entry["level"] == "SEVERE"]

    def screenshot(self, path):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self.ask("GET", "/screenshot")))
