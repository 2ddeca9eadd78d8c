"""A report as a page: one file, pictures inside, readable in a browser."""

import matplotlib.pyplot as plt

from rotorjax.io.page import write_page
from tests.browser import needs_browser, seen

REPORT = """# Inflow & more

Five lines:

1. one
2. two

## Numbers

| h | C_T |
|---|---|
| 1 | 0.006 |
| 2 | 0.005 |

![Fig. 1](fig01.png) ![gone](gone.png)
"""


def written(folder):
    figure = plt.figure(figsize=(3, 2))
    figure.add_subplot().plot([0, 1], color="tab:red", lw=10)
    figure.savefig(folder / "fig01.png")
    plt.close(figure)
    write_page(folder / "report.html", REPORT)
    return folder / "report.html"


def test_the_page_is_whole(tmp_path):
    text = written(tmp_path).read_text()
    assert "<title>Inflow &amp; more</title>" in text
    assert text.count("data:image/png;base64,") == 1
    assert 'src="gone.png"' in text, "a picture that is not there stays a link"
    assert '<td class="number">0.006</td>' in text
    assert 'href="#numbers"' in text
    assert "<ol>" in text
    assert "{{" not in text
    assert "://" not in text


@needs_browser
def test_a_browser_shows_the_picture(tmp_path):
    picture, said = seen(written(tmp_path), tmp_path)
    assert said == []
    red, green, blue = picture.reshape(-1, 3).T
    assert ((red > 0.7) & (green < 0.3) & (blue < 0.3)).mean() > 0.005
