"""Object code of numba's functions: all that one C function calls, optimised and generated once.

Numba optimises every function by itself, generates its code, and does both again for each function that calls it, into
which it is inlined: what is called in a depth of ten is compiled ten times. Here numba only types functions and writes
their LLVM modules; these are linked when all are there.

Nothing in the object code is of the process that made it, but calls of C functions by name. Addresses that it works on
stand in a table (see `loader`).
"""

import collections
import contextlib
import functools
import gc
import re
from collections.abc import Callable, Generator

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import compiler, config, types
from numba.core.codegen import CPUCodeLibrary, JITCPUCodegen
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import _DispatcherBase, _FunctionCompiler
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys

from fieldsim.errors import FieldsimError

# The name of the C function in every object.
ENTRY = "fieldsim_entry"
# What modules define for all the world, and may define twice.
_SHARED = {llvm.Linkage.external, llvm.Linkage.linkonce_odr, llvm.Linkage.weak_odr}


class _Library(CPUCodeLibrary):
    """A function's module, neither optimised nor linked with what it calls."""

    def _optimize_functions(self, ll_module):
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self):
        self._finalized = True

    def get_pointer_to_function(self, name):
        """0: there is no code yet."""
        return 0

    def _callees(self) -> list:
        """All libraries that it calls, also indirectly, and each before those that it calls."""
        found = dict.fromkeys(self._linking_libraries)
        for library in list(found):
            if isinstance(library, _Library):
                found.update(dict.fromkeys(library._callees()))
        return list(found)

    def whole(self, linkage: str, *, uncounted: bool = False):
        """Its module linked with all that it calls; linkage: of all functions in it.

        uncounted: whether numba's counts of references do nothing.
        """
        module = _with_linkage(self._final_module.clone(), "weak_odr")
        if uncounted:
            module.link_in(_without_counting())
        for library in self._callees():
            own = isinstance(library, _Library)
            other = library._final_module if own else library._get_module_for_linking()
            module.link_in(_with_linkage(other.clone(), "weak_odr"))
        return _with_linkage(module, linkage)

    def _get_module_for_linking(self):
        """For libraries of numba's own, which take what was compiled once for all, such as `max`."""
        if self._shared_module is None:
            self._shared_module = self.whole("linkonce_odr")
        return self._shared_module


@functools.cache
def _without_counting_text():
    module = ir.Module()
    pointer = ir.IntType(8).as_pointer()
    for name in ("NRT_incref", "NRT_decref"):
        function = ir.Function(module, ir.FunctionType(ir.VoidType(), [pointer]), name)
        function.linkage = "weak_odr"
        function.attributes.add("alwaysinline")
        ir.IRBuilder(function.append_basic_block()).ret_void()
    return str(module)


def _without_counting():
    """A module that takes the place of numba's: what is kept on disk works on memory that is not numba's."""
    return llvm.parse_assembly(_without_counting_text())


def _with_linkage(module, linkage):
    for function in module.functions:
        if not function.is_declaration and function.linkage in _SHARED:
            function.linkage = linkage
    return module


class _Codegen(JITCPUCodegen):
    """Numba's target machine, which adds nothing to this process."""

    _library_class = _Library

    def _add_module(self, module):
        pass

    def set_env(self, env_name, env):
        """Nothing: environments serve Python's objects."""


@functools.cache
def _codegen():
    return _Codegen("fieldsim.native")


@contextlib.contextmanager
def _apart() -> Generator[_Codegen]:
    """What numba compiles within goes to libraries of ours, once for all constants that it is called with."""
    context = cpu_target.target_context
    rtsys.initialize(context)  # it holds on to what it compiles
    before, context._internal_codegen = context._internal_codegen, _codegen()
    template_of = _DispatcherBase.get_call_template

    def general(self, args, kws):
        _refuse_pythons(self)
        return template_of(
            self, [types.unliteral(one) for one in args], {k: types.unliteral(v) for k, v in kws.items()}
        )

    _DispatcherBase.get_call_template = general
    # A compiler makes much that lives long: looking for what does not takes a sixth of the time.
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield context._internal_codegen
    finally:
        context._internal_codegen, _DispatcherBase.get_call_template = before, template_of
        if collecting:
            gc.enable()


def _refuse_pythons(dispatcher):
    """Raise FieldsimError for a function that Python may call: it would find no code, and end the process."""
    module = dispatcher.py_func.__module__ or ""
    if module.partition(".")[0] != "numba" and not dispatcher.targetoptions.get("no_cpython_wrapper"):
        raise FieldsimError(
            f"numba's function {module}.{dispatcher.py_func.__qualname__} is one that Python may call, and a native "
            "function calls it; use a portable function's .native, or fieldsim.native.inner"
        )


class _Compiler(_FunctionCompiler):
    def _customize_flags(self, flags):
        flags.no_cpython_wrapper = flags.no_cfunc_wrapper = flags.no_compile = True
        flags.enable_pyobject = False
        return flags


def object_code(function: Callable, signature) -> tuple[bytes, list[str], list[str]]:
    """Object code with the C function ENTRY, which calls `function`; names that it needs, and of variables that it has.

    signature: of numba's types, such as types.void(types.intp). Raises FieldsimError where it calls a numba function
    that Python may call too: what is compiled here has no code for Python.
    """
    with global_compiler_lock, _apart() as codegen:
        options = {"error_model": "numpy"}
        made = _Compiler(function, cpu_target, options, {}, compiler.Compiler)
        compiled = made.compile(signature.args, signature.return_type)
        compiled.library.add_ir_module(_entry(compiled.fndesc))
        module = compiled.library.whole("internal", uncounted=True)
        module.get_function(ENTRY).linkage = "external"
        module.verify()
        _optimise(module, codegen._tm)
        named = collections.Counter(re.findall(r"@([\w.$]+)", str(module)))
        declared = [f.name for f in module.functions if f.is_declaration and not f.name.startswith("llvm.")]
        missing = [name for name in declared if named[name] > 1]  # others are left over
        variables = [v.name for v in module.global_variables if v.linkage == llvm.Linkage.common]
        return codegen._tm.emit_object(module), missing, variables


def _optimise(module, machine):
    options = llvm.create_pipeline_tuning_options(speed_level=int(config.OPT))
    options.loop_vectorization, options.slp_vectorization = bool(config.LOOP_VECTORIZE), bool(config.SLP_VECTORIZE)
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)


def _entry(described):
    """A module with the C function: it calls what numba has compiled, which cannot fail."""
    context = cpu_target.target_context
    module = context.create_module(ENTRY)
    kind = context.call_conv.get_function_type(described.restype, described.argtypes)
    callee = ir.Function(module, kind, described.llvm_func_name)
    empty = described.restype == types.void
    result = ir.VoidType() if empty else context.get_value_type(described.restype)
    arguments = [context.get_value_type(one) for one in described.argtypes]
    entry = ir.Function(module, ir.FunctionType(result, arguments), ENTRY)
    builder = ir.IRBuilder(entry.append_basic_block())
    _, out = context.call_conv.call_function(builder, callee, described.restype, described.argtypes, entry.args)
    if empty:
        builder.ret_void()
    else:
        builder.ret(out)
    return module
