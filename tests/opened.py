"""A page open in a browser, and what it did that it should not."""


class Watched:
    """A page, and what it did that it should not."""

    def __init__(self, browser, path, **settings):
        self.context = browser.new_context(viewport={"width": 1000, "height": 900}, **settings)
        self.page, self.wrong, self.requests = self.context.new_page(), [], []
        self.page.on("console", lambda message: self.wrong.append(message.text))
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on("dialog", lambda dialog: self.wrong.append(dialog.message))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(path.as_uri())

    def point_at(self, plot: int, across: float, down: float) -> str:
        """The hover text at these parts of a plot's width and height."""
        drawing = self.page.locator("svg.plot").nth(plot)
        drawing.scroll_into_view_if_needed()
        box = drawing.bounding_box()
        self.page.mouse.move(box["x"] + across * box["width"], box["y"] + down * box["height"])
        tip = self.page.locator(".tip:visible")
        seen = tip.bounding_box()
        # Beside what is pointed at, and within the picture.
        assert abs(seen["x"] + seen["width"] / 2 - box["x"] - across * box["width"]) < 300
        assert box["y"] <= seen["y"] <= box["y"] + box["height"]
        return tip.inner_text()
