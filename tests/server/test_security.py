"""meshsdf.server.security: whom the gate lets in, by headers alone."""

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshsdf.server.limits import Refused
from meshsdf.server.security import Gate

GATE = Gate(8765)
OWN = "http://127.0.0.1:8765"
NAMED = "the address that it printed"


def scope(path="/api/project", method="GET", kind="http", host="127.0.0.1:8765", **headers) -> dict:
    """A request as ASGI tells it; headers that are None are left out."""
    given = {"host": host} | {name.replace("_", "-"): value for name, value in headers.items()}
    pairs = [(k.encode(), v.encode()) for k, v in given.items() if v is not None]
    return {"type": kind, "path": path, "method": method, "headers": pairs}


def bearer(token: str = GATE.token) -> str:
    return f"Bearer {token}"


def cookie(gate: Gate = GATE) -> str:
    return gate.set_cookie().split(";")[0]


def status(**request) -> int:
    """With which number the gate refuses; 0 if it does not."""
    try:
        GATE.check(scope(**request))
    except Refused as refused:
        return refused.status
    return 0


def test_secrets_are_long_and_differ():
    one, other = Gate(1), Gate(1)
    assert len({one.token, one.key, other.token, other.key}) == 4
    assert all(len(text) >= 43 for text in (one.token, one.key))  # 256 bits, 6 a letter
    assert one.token not in repr(one)
    assert one.key not in repr(one)


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8765", "localhost:8765", "LocalHost:8765", "127.0.0.1:08765"]
)
def test_a_server_goes_by_its_address_and_by_localhost(host):
    assert GATE.admits_host(host)


@pytest.mark.parametrize(
    "host",
    [
        "example.org:8765", "127.0.0.1.example.org:8765", "localhost.example.org:8765",
        "127.0.0.1", "127.0.0.1:80", "127.0.0.1:8765:8765", "127.0.0.1:", ":8765", "",
        "[::1]:8765", "[::1]", "[::1", "[::1]8765", "[127.0.0.1]:8765", "[::ffff:127.0.0.1]:8765",
        "localhost.:8765", "127.1:8765", "0.0.0.0:8765", "2130706433:8765", "127.0.0.2:8765",
        "127.0.0.1:8765 ", " 127.0.0.1:8765", "127.0.0.1:+8765", "127.0.0.1:８７６５", "[]:8765",
        "user@127.0.0.1:8765", "127.0.0.1:8765/", "127.0.0.1:99999999",
    ],
)  # fmt: skip
def test_any_other_host_is_refused(host):
    assert not GATE.admits_host(host)


@given(st.text(string.ascii_letters + string.digits + ".:[]-@/% ", max_size=30))
def test_no_made_up_host_gets_in(host):
    name, _, port = host.rpartition(":")
    is_own = name.lower() in ("localhost", "127.0.0.1") and port.lstrip("0") == "8765"
    assert GATE.admits_host(host) == (is_own and len(port) <= 5)


def test_ipv6_loopback_is_admitted_where_the_server_is_bound_to_it_and_only_there():
    six = Gate(8765, "::1")
    assert six.admits_host("[::1]:8765")
    assert six.admits_host("[0:0:0:0:0:0:0:1]:8765")
    assert six.admits_host("localhost:8765")
    assert not six.admits_host("127.0.0.1:8765")
    assert not six.admits_host("::1:8765")


def test_a_server_on_all_addresses_takes_those_in_numbers_as_names_could_be_rebound():
    every = Gate(8765, "0.0.0.0")
    assert every.admits_host("192.168.0.7:8765")
    assert every.admits_host("[fe80::1]:8765")
    assert not every.admits_host("rebound.example:8765")
    one = Gate(8765, "192.168.0.7")
    assert one.admits_host("192.168.0.7:8765")
    assert not one.admits_host("192.168.0.8:8765")
    assert not one.admits_host("localhost:8765")


def test_the_port_may_be_left_out_where_browsers_leave_it_out():
    assert Gate(80).admits_host("127.0.0.1")
    assert not Gate(80).admits_host("127.0.0.1:8765")


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize("host", ["rebound.example:8765", "[::1]:8765", None])
def test_a_request_for_another_host_is_refused_whatever_it_knows(kind, host):
    known = {"authorization": bearer(), "origin": f"http://{host}"}
    assert status(kind=kind, host=host, **known) == 421


def test_two_hosts_are_none():
    twice = scope(authorization=bearer())
    twice["headers"].append((b"host", b"127.0.0.1:8765"))
    with pytest.raises(Refused, match="this server is not"):
        GATE.check(twice)


def test_all_but_the_page_itself_needs_a_key():
    for path in ("/", "/static/main.js", "/favicon.ico"):
        assert status(path=path) == 0
    for path in ("/api/project", "/api/", "/api", "/api/exports/x.glb", "/api/session"):
        assert status(path=path) == 401
        assert status(path=path, authorization=bearer()) == 0
        assert status(path=path, cookie=cookie()) == 0
    assert status(path="/api/session", method="POST", origin=OWN) == 0
    assert status(path="/api/session/", method="POST", origin=OWN) == 401


@pytest.mark.parametrize(
    "given",
    [
        {"authorization": bearer(GATE.key)},
        {"authorization": bearer("")},
        {"authorization": bearer(GATE.token[:-1])},
        {"authorization": f"Basic {GATE.token}"},
        {"authorization": GATE.token},
        {"cookie": f"{GATE.cookie}={GATE.token}"},
        {"cookie": f"{GATE.cookie}="},
        {"cookie": f"meshsdf_8766={GATE.key}"},
        {"cookie": GATE.cookie},
        {"authorization": bearer("wrong"), "cookie": cookie()},
    ],
)
def test_what_is_no_key_does_not_open(given):
    assert status(**given) == 401


def test_the_right_cookie_is_found_among_others():
    assert status(cookie=f"a=b; {GATE.cookie}=old; {cookie()}; c") == 0


def test_the_cookie_is_for_this_port_for_no_script_and_for_no_other_site():
    name, *attributes = GATE.set_cookie().split("; ")
    assert name.startswith("meshsdf_8765=")
    assert set(attributes) == {"Path=/api", "HttpOnly", "SameSite=Strict"}


@pytest.mark.parametrize(
    "origin",
    [
        "http://example.org", "null", "http://127.0.0.1:9999", "https://127.0.0.1:8765",
        "http://localhost:8765", "http://127.0.0.1", "http://127.0.0.1:8765.example.org", "",
    ],
)  # fmt: skip
@pytest.mark.parametrize("how", [{"kind": "websocket"}, {"method": "POST"}, {"method": "GET"}])
def test_a_page_from_elsewhere_may_not_even_if_the_browser_adds_the_cookie(origin, how):
    assert status(origin=origin, cookie=cookie(), **how) == 403
    assert status(origin=origin, authorization=bearer(), **how) == 403


@pytest.mark.parametrize("how", [{"kind": "websocket"}, {"method": "POST"}, {"method": "DELETE"}])
def test_who_sends_says_from_where_or_brings_the_token_itself(how):
    assert status(cookie=cookie(), **how) == 403
    assert status(cookie=cookie(), origin=OWN, **how) == 0
    assert status(authorization=bearer(), **how) == 0
    assert status(origin=OWN, **how) == 401


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_another_page_cannot_fetch_data_but_may_link_to_the_page(site):
    assert status(cookie=cookie(), sec_fetch_site=site) == 403
    assert status(path="/", sec_fetch_site=site) == 0
    assert status(cookie=cookie(), sec_fetch_site="same-origin") == 0


def test_nothing_can_be_sent_to_the_page_itself():
    assert status(path="/", method="POST", origin=OWN) == 405


def test_a_token_of_half_characters_is_just_wrong():
    assert not GATE.is_token("\ud800")
    assert not GATE.is_token("é" * 43)
