"""Debian's Chromium without a window or a network, for tests of the viewer's pages."""

import json
import shutil
import tempfile
import time
from pathlib import Path

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--hide-scrollbars",
    "--host-resolver-rules=MAP * ~NOTFOUND",
)
CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")


class Browser:
    """A browser of its own profile; `folder` holds what it downloads."""

    def __init__(self, width: int, height: int, phone: bool = False, flags: tuple[str, ...] = ()):
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        self.folder = Path(tempfile.mkdtemp())
        options = webdriver.ChromeOptions()
        for flag in (
            *FLAGS,
            f"--user-data-dir={self.folder / 'profile'}",
            f"--window-size={width},{height}",
            *flags,
        ):
            options.add_argument(flag)
        options.binary_location = CHROMIUM
        options.add_experimental_option("prefs", {"download.default_directory": str(self.folder)})
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(DRIVER))
        self.driver.set_script_timeout(120)  # a machine may be busy
        self.resize(width, height, phone)
        self.driver.get_log("performance")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.driver.quit()
        shutil.rmtree(self.folder, ignore_errors=True)

    def resize(self, width: int, height: int, phone: bool = False) -> None:
        metrics = {"width": width, "height": height, "deviceScaleFactor": 2 if phone else 1, "mobile": phone}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        self.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": phone})

    def prefer(self, **features: str) -> None:
        """What the person prefers, ``color_scheme`` or ``reduced_motion``; all else as by default."""
        named = [{"name": f"prefers-{k.replace('_', '-')}", "value": v} for k, v in features.items()]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": named})

    def open(self, path: Path) -> float:
        """Seconds until the page is ready."""
        start = time.perf_counter()
        self.driver.get(path.resolve().as_uri())
        self.until("document.documentElement.dataset.ready || document.documentElement.dataset.failed", 120)
        return time.perf_counter() - start

    def js(self, code: str, *arguments):
        return self.driver.execute_script("return " + code, *arguments)

    def until(self, code: str, seconds: float = 10):
        """The value of an expression, as soon as it is true."""
        end = time.perf_counter() + seconds
        while not (value := self.js(code)):
            assert time.perf_counter() < end, f"{code} stays {value!r}: {self.errors()}"
            time.sleep(0.02)
        return value

    def frame(self) -> None:
        """Wait until what has been asked for is drawn."""
        self.until("!viewer.drawing.waiting")

    def click(self, x: float, y: float) -> None:
        """A click of the mouse, or a tap where touch is on, at a place of the canvas."""
        left, top = self.js("(r => [r.x, r.y])(document.querySelector('#view').getBoundingClientRect())")
        for kind in ("mousePressed", "mouseReleased"):
            event = {"type": kind, "x": left + x, "y": top + y, "button": "left", "clickCount": 1}
            self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)

    def tap(self, x: float, y: float) -> None:
        """A tap of a finger at a place of the canvas."""
        left, top = self.js("(r => [r.x, r.y])(document.querySelector('#view').getBoundingClientRect())")
        touch = [{"x": left + x, "y": top + y}]
        self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": touch})
        self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def pinch(self, x: float, y: float, before: float, after: float, steps: int = 8) -> None:
        """Two fingers about a place of the canvas, so many pixels apart before and after."""
        left, top = self.js("(r => [r.x, r.y])(document.querySelector('#view').getBoundingClientRect())")
        for step in range(steps + 1):
            half = (before + (after - before) * step / steps) / 2
            fingers = [{"x": left + x + sign * half, "y": top + y, "id": i} for i, sign in enumerate((-1, 1))]
            kind = "touchMove" if step else "touchStart"
            self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})
        self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def key(self, key: str, **more) -> None:
        self.js(
            "dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0], ...arguments[1]}))", key, more
        )

    def set(self, css: str, value) -> None:
        """Move a slider, choose an option or tick a box as a person would."""
        self.js(
            "(([css, value]) => { const e = document.querySelector(css);"
            " e[e.type === 'checkbox' ? 'checked' : 'value'] = value;"
            " for (const kind of ['input', 'change']) e.dispatchEvent(new Event(kind, {bubbles: true}));"
            " })(arguments[0])",
            [css, value],
        )

    def pixels(self):
        """What the canvas shows, (height, width, 4)."""
        import base64
        import io

        import numpy as np
        from PIL import Image

        self.frame()
        url = self.js("document.querySelector('#view').toDataURL()")
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(url.split(",")[1])))).astype(int)

    def requests(self) -> list[str]:
        """Addresses outside the file that the page asked for."""
        messages = (json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance"))
        asked = (
            m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"
        )
        return [url for url in asked if not url.startswith(("file:", "data:", "blob:", "chrome"))]

    def errors(self) -> list[str]:
        return [entry["message"] for entry in self.driver.get_log("browser")]
