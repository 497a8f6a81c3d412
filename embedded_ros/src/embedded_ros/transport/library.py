# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The few CycloneDDS C functions called directly, through ctypes.

``cyclonedds`` wraps most of what is needed. These exist besides because its write holds the
interpreter lock while it blocks (a stopped reliable reader would freeze every thread), and
because its wait set does not say which of its conditions triggered.
"""

from __future__ import annotations

import ctypes as ct

from cyclonedds.internal import DDS

_library = DDS._dll_handle

RETCODE_TIMEOUT = -10
RETCODE_BAD_PARAMETER = -3
RETCODE_ALREADY_DELETED = -9
RETCODE_NO_DATA = -11


class RawSample(ct.Structure):
    """How cyclonedds's topics take a serialized sample: pointer and size."""

    _fields_ = (("data", ct.c_char_p), ("size", ct.c_size_t))


def _function(name: str, *arguments: type) -> ct._FuncPointer:
    return ct.CFUNCTYPE(ct.c_int32, *arguments)((name, _library))


_Handles = ct.POINTER(ct.c_void_p)

dds_write = _function("dds_write", ct.c_int32, ct.POINTER(RawSample))
dds_delete = _function("dds_delete", ct.c_int32)
dds_create_waitset = _function("dds_create_waitset", ct.c_int32)
dds_waitset_attach = _function("dds_waitset_attach", ct.c_int32, ct.c_int32, ct.c_void_p)
dds_waitset_detach = _function("dds_waitset_detach", ct.c_int32, ct.c_int32)
dds_waitset_wait = _function("dds_waitset_wait", ct.c_int32, _Handles, ct.c_size_t, ct.c_int64)
dds_create_guardcondition = _function("dds_create_guardcondition", ct.c_int32)
dds_set_guardcondition = _function("dds_set_guardcondition", ct.c_int32, ct.c_bool)
dds_create_readcondition = _function("dds_create_readcondition", ct.c_int32, ct.c_uint32)


def write_sample(writer: int, data: bytes) -> int:
    """Write serialized bytes; the interpreter lock is released while it blocks."""
    return int(dds_write(writer, ct.byref(RawSample(data, len(data)))))
