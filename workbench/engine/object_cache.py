"""Machine code from LLVM IR, kept in the user's cache folder so that only the first start pays for the compiler."""

import ctypes
import hashlib
import platform
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from threading import Lock
from weakref import WeakValueDictionary, finalize

import llvmlite.binding as llvm

from ..base.private_cache import store, stored
from ..base.recent import Recent
from .vector_math import LIBM

_LINKER = 200_000  # bytes that the linker of an object takes, beside its code


class Library:
    """The functions of some machine code, by name: their addresses are good as long as somebody holds the library."""

    def __init__(self, code: bytes, names: Sequence[str]) -> None:
        self.size = len(code) + _LINKER
        self._called = [library for name, library in list(_PROVIDED.items()) if name.encode() in code]
        builder = llvm.JITLibraryBuilder().add_object_img(code).add_current_process()
        for symbol, address in _c_library().items():
            builder.import_symbol(symbol, address)
        for name, library in list(_PROVIDED.items()):
            builder.import_symbol(name, library[name])
        for exported in names:
            builder.export_symbol(exported)
        # The linker keeps the sections of an object together, which must be within 2 GB of each other; one that all
        # objects share would keep a part of each, when that is unloaded.
        jit = llvm.create_lljit_compiler(_target(), use_jit_link=True)
        tracker = builder.link(jit, "plant")
        self._addresses = {name: tracker[name] for name in names}
        finalize(self, _unload, tracker, jit).atexit = False  # then threads may still be in it

    def __getitem__(self, name: str) -> int:
        return self._addresses[name]


def _unload(tracker: llvm.ResourceTracker, jit: llvm.LLJIT) -> None:
    tracker.close()
    jit.close()


_LOADED: "WeakValueDictionary[str, Library]" = WeakValueDictionary()  # by key
_PROVIDED: "WeakValueDictionary[str, Library]" = WeakValueDictionary()  # by a function that other code calls
_RECENT = Recent[str, Library](16e6, lambda library: library.size)  # bytes; they stay though nobody holds them
_ONE_AT_A_TIME = Lock()


def load(
    key: Sequence[str], write: Callable[[], str], names: Sequence[str], optimised: bool = False, hasty: bool = False
) -> Library:
    """The named functions of the IR that `write` returns; `key` tells it from every other IR.

    `optimised`: IR with loops and variables in memory, which the compiler is to work on first. `hasty`: code that will
    run for a short time, and is compiled in a third of the time to run up to twice as long, to the same bits, unless
    better code is there.
    """
    hasty = hasty and not compiled(key)
    digest = _digest([*key, "hasty"] if hasty else key)
    with _ONE_AT_A_TIME:
        library = _LOADED.get(digest)
        if library is None:
            name = f"{digest}.o"
            library = Library(stored(name) or store(name, _compile(write(), optimised, hasty)), names)
        _LOADED[digest] = library
        _RECENT.keep(digest, library)
    return library


def provide(name: str, library: Library) -> None:
    """Let IR that is linked from now on, and holds the library, call its function of this name."""
    _PROVIDED[name] = library


def compiled(key: Sequence[str]) -> bool:
    """Whether `load` needs no compiler for a key."""
    digest = _digest(key)
    return digest in _LOADED or bool(stored(f"{digest}.o"))


def _digest(key: Sequence[str]) -> str:
    return hashlib.sha256("\0".join([*key, *_machine_key()]).encode()).hexdigest()


def vector_width() -> int:
    """Lanes of a block: two registers of AVX-512, or what suits narrower ones."""
    return 8 if _features().get("avx512f") else 4


def fused() -> bool:
    """Whether the processor multiplies and adds in one rounding."""
    return platform.machine().lower() in ("arm64", "aarch64") or bool(_features().get("fma"))


@cache
def _features() -> dict[str, bool]:
    return dict(llvm.get_host_cpu_features())


@cache
def _machine_key() -> list[str]:
    version = ".".join(map(str, llvm.llvm_version_info))
    sources = [path.read_text(encoding="utf-8") for path in sorted(Path(__file__).parent.glob("*.py"))]
    return [version, llvm.get_process_triple(), llvm.get_host_cpu_name(), str(sorted(_features().items())), *sources]


@cache
def _target(hasty: bool = False) -> llvm.TargetMachine:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    _instructions_by_graph()
    return llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=llvm.get_host_cpu_features().flatten(),
        opt=0 if hasty else 1,  # with 2 it takes up to twice as long, and its code runs as fast, to the same bits
        reloc="pic",
        codemodel="small",
    )


@cache
def _instructions_by_graph() -> None:
    """In haste LLVM takes one instruction after the other instead, which is slow in the long blocks of a platform."""
    llvm.set_option("jackbench", "-fast-isel=false")  # once a process


def _compile(ir: str, optimised: bool, hasty: bool) -> bytes:
    with llvm.create_context() as context, llvm.parse_assembly(ir, context) as code:  # a context keeps every constant
        if optimised:
            passes = llvm.create_pass_builder(_target(), llvm.create_pipeline_tuning_options(speed_level=3))
            passes.getModulePassManager().run(code, passes)
        return _target(hasty).emit_object(code)


@cache
def _c_library() -> dict[str, int]:
    """Addresses of the mathematical functions of C."""
    library = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)
    addresses = {}
    for name in ("pow", "sin", "cos", *LIBM):
        with suppress(AttributeError):
            addresses[name] = ctypes.cast(getattr(library, name), ctypes.c_void_p).value or 0
    return addresses
