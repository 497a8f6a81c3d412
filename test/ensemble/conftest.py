# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
import importlib
import os
import sys

import pytest

from slap_ros.domains import forget_domains


@pytest.fixture
def install_domain(tmp_path, monkeypatch):
    """Installs a distribution of somebody's in a folder: the module NAME_domain, made by make()."""
    modules = []

    def install(name, source):
        module = f"{name}_domain"
        modules.append(module)
        (tmp_path / f"{module}.py").write_text(source)
        info = tmp_path / f"{module}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
        entry = f"[slap_ros.domains]\n{name} = {module}:make\n"
        (info / "entry_points.txt").write_text(entry)
        monkeypatch.syspath_prepend(tmp_path)
        path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
        monkeypatch.setenv("PYTHONPATH", path)
        importlib.invalidate_caches()
        forget_domains()
        return name

    yield install
    forget_domains()
    for module in modules:
        sys.modules.pop(module, None)
