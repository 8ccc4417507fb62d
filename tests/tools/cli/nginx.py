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
    access_log off; client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi; uwsgi_temp_path {folder}/uwsgi; scgi_temp_path {folder}/scgi;
    server {{ listen 127.0.0.1:{port}; root {folder}; }}
}}
"""


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def serve(test):
    """Serves the folder of a test until the test's end, and returns the port."""
    port = free_port()
    configuration = test.write("nginx.conf", CONFIGURATION.format(folder=test.folder, port=port))
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
