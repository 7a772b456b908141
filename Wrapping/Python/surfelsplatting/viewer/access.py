# SPDX-License-Identifier: BSD-3-Clause
"""Who may use the page: requests of other sites and those without the token are refused."""

import hmac
import ipaddress
import secrets
from urllib.parse import urlsplit

PARAMETER = "token"


def new_token():
    return secrets.token_urlsafe(16)


def is_loopback(host):
    """Whether only this machine reaches an address or the name localhost."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class Gate:
    """Decides about a request by its headers, the same for files and for the web socket.

    token: which the address or the cookie has to have. Without one (None) the page is for this
    machine only, and the browser must have asked for this machine: a name of another site that
    leads here (DNS rebinding) is refused.
    """

    def __init__(self, token):
        self._token = token
        # Cookies know no port; other pages of this machine have their own.
        self._cookie = f"surfelsplat_{secrets.token_hex(4)}"

    def refusal(self, host, origin, query_token, cookie_token):
        """-> why a request is refused, or None. host, origin: of its headers."""
        if not self._token and not is_loopback(urlsplit(f"//{host}").hostname or ""):
            return "this page is for its own machine only"
        if origin and urlsplit(origin).netloc != host:
            return "another site has asked"
        if self._token and not any(
                token and hmac.compare_digest(token.encode(), self._token.encode())
                for token in (query_token, cookie_token)):
            return "the token is missing or wrong; use the whole address that surfelsplat printed"
        return None

    def middleware(self):
        """For aiohttp."""
        from aiohttp import web

        @web.middleware
        async def guard(request, handler):
            given = request.query.get(PARAMETER)
            refusal = self.refusal(request.host, request.headers.get("Origin"), given,
                                   request.cookies.get(self._cookie))
            if refusal:
                return web.Response(status=403, text=f"surfelsplat: {refusal}\n")
            if self._token and given:
                # The page's own requests come with the cookie; the token leaves the address bar.
                response = web.HTTPFound(request.path)
                response.set_cookie(self._cookie, self._token, httponly=True, samesite="Lax")
                return response
            return await handler(request)

        return guard
