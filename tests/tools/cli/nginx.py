# SPDX-License-Identifier: MIT
"""Shared by tests with nginx: starting it for the files of a folder."""

import os
import shutil
import socket
import subprocess
import time

NGINX = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin")
CONFIGURATION = """daemon off; master_process off; pid {folder}/nginx.pid; error_log {folder}/error.log;
events {{ worker_connections 256; }}
http {{
    client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi; uwsgi_temp_path {folder}/uwsgi; scgi_temp_path {folder}/scgi;
    log_format requests "$server_protocol $connection"; access_log {folder}/access{port}.log requests;
    server {{ listen 127.0.0.1:{port} {options}; root {folder}; }}
}}
"""


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def serve(test, options=""):
    """Serves the folder of a test until the test's end, and returns the port.

    options: of nginx's directive "listen", and further directives of the server. access<port>.log has protocol and connection of each request."""
    port = free_port()
    configuration = test.write(f"nginx{port}.conf", CONFIGURATION.format(folder=test.folder, port=port, options=options))
    server = subprocess.Popen([NGINX, "-e", test.path("error.log"), "-c", configuration])
    test.addCleanup(server.wait)
    test.addCleanup(server.terminate)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        test.assertIsNone(server.poll())
        try:
            socket.create_connection(("127.0.0.1", port)).close()
            return port
        except OSError:
            time.sleep(0.05)
    raise AssertionError("nginx does not listen")
