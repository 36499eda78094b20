"""The loop around an attempt, as LLVM IR: it feeds lanes with intervals and trajectories and stores what they reach.

Lanes do not wait for each other: the one that reaches the end of its interval stores its state and takes the next
interval, or the next trajectory, while its neighbours go on. Threads that run the same job share it: each takes the
next trajectory that nobody has.
"""

from .jobs import Frame, RunJob
from .scalars import Scalars


def run(frame: Frame) -> list[str]:
    """`run`: attempts of the whole block for as long as a lane has something to do."""
    b, places, width = Scalars(RunJob, "%run_job"), frame.places, frame.width
    p, tolerance = b.get("p"), b.get("tolerance")
    for element in range(places["end"]):
        b.store("0", "%frame", element, "i64")
    for w in range(width):
        b.store(tolerance, "%frame", places["tolerance"] + w)
        b.store("-1", "%frame", places["lane"] + w, "i64")
        for i in range(frame.parameters):
            b.store(b.load(p, i), "%frame", places["p"] + i * width + w)
    return [
        "declare i64 @llvm.cttz.i64(i64, i1)",
        "define void @run(ptr %job) nounwind {",
        "entry:",
        f"  %frame = alloca [{places['end']} x i64], align 64",
        *b.lines,
        "  call void @prepare(ptr %frame)",
        "  br label %serve",
        "serve:",
        f"  %wanted = phi i64 [{(1 << width) - 1}, %entry], [%others, %serve], [%now, %go]",
        f"  %busy = phi i64 [{width}, %entry], [%still, %serve], [%still, %go]",
        "  %slot = call i64 @llvm.cttz.i64(i64 %wanted, i1 true)",
        "  %gone = call i64 @service(ptr %job, ptr %frame, i64 %slot)",
        "  %still = sub i64 %busy, %gone",
        "  %below = sub i64 %wanted, 1",
        "  %others = and i64 %wanted, %below",
        "  %more = icmp ne i64 %others, 0",
        "  br i1 %more, label %serve, label %served",
        "served:",
        "  %idle = icmp eq i64 %still, 0",
        "  br i1 %idle, label %done, label %go",
        "go:",
        "  %now = call i64 @attempt(ptr %frame)",
        "  %none = icmp eq i64 %now, 0",
        "  br i1 %none, label %go, label %serve",
        "done:",
        "  ret void",
        "}",
    ]


class _Service:
    """Writes `service`, which looks after one lane between attempts; returns 1 when the lane has nothing left to do."""

    def __init__(self, frame: Frame) -> None:
        self.frame, self.places = frame, frame.places
        self.b = Scalars(RunJob, "%run_job")
        self._entry()
        self._store()
        self._finish()
        self._begin()
        self._interval()

    def _get(self, name: str, kind: str = "double", element: int = 0) -> str:
        return self.b.load("%slot", self.places[name] + element * self.frame.width, kind)

    def _set(self, value: str, name: str, kind: str = "double", element: int = 0) -> None:
        self.b.store(value, "%slot", self.places[name] + element * self.frame.width, kind)

    def _entry(self) -> None:
        b = self.b
        b.write("%slot = getelementptr i64, ptr %frame, i64 %w")
        self.lane = self._get("lane", "i64")
        b.branch(b.do(f"icmp slt i64 {self.lane}, 0"), "refill", "running")
        b.write("running:")
        self.row = self._get("row", "i64")
        b.branch(b.do(f"fcmp ole double {self._get('left')}, 0.0"), "arrived", "failed")

    def _store(self) -> None:
        """A state that is finite goes to its row of the trajectory, if the row is one that is kept."""
        b, n = self.b, self.frame.n
        b.write("arrived:")
        state = [self._get("x", element=i) for i in range(n)]
        zeros = [b.do(f"fsub double {value}, {value}") for value in state]
        while len(zeros) > 1:
            zeros = [*zeros[2:], b.do(f"fadd double {zeros[0]}, {zeros[1]}")]
        b.branch(b.do(f"fcmp oeq double {zeros[0]}, 0.0"), "finite", "failed")
        b.write("finite:")
        wait = b.integer("sub", self._get("wait", "i64"), 1)
        b.branch(b.do(f"icmp eq i64 {wait}, 0"), "keep", "onward")
        b.write("keep:")
        target = self._get("target", "ptr")
        for i, value in enumerate(state):
            b.store(value, target, i)
        self._set(b.at(target, n), "target", "ptr")
        every = b.get("every")
        b.write("br label %onward")
        b.write("onward:")
        self._set(b.do(f"phi i64 [{wait}, %finite], [{every}, %keep]"), "wait", "i64")
        self.after = b.integer("add", self.row, 1)
        b.branch(b.do(f"icmp eq i64 {self.after}, {b.get('rows')}"), "finish", "interval")

    def _finish(self) -> None:
        b = self.b
        b.write("failed:")
        b.store(self.row, b.get("failed"), self.lane, "i64")
        b.write("br label %finish")
        b.write("finish:")
        attempts = b.do(f"fptosi double {self._get('attempts')} to i64")
        b.store(attempts, b.get("attempts"), self.lane, "i64")
        b.write("br label %refill")
        b.write("refill:")
        self.taken, some = b.take()
        b.branch(some, "begin", "idle")
        b.write("idle:")  # no time left that could be over, and no limit: nothing happens, nothing is asked for
        for value, name in (("0x7FF8000000000000", "left"), ("1.0", "step"), ("0x7FF0000000000000", "limit")):
            self._set(value, name)
        b.write("ret i64 1")

    def _begin(self) -> None:
        b, n = self.b, self.frame.n
        b.write("begin:")
        self._set(self.taken, "lane", "i64")
        source = b.at(b.get("x0"), b.integer("mul", self.taken, n))
        for i in range(n):
            self._set(b.load(source, i), "x", element=i)
        first = b.at(b.get("x"), b.integer("mul", self.taken, b.integer("mul", b.get("records"), n)))
        self._set(b.at(first, n), "target", "ptr")
        self._set(b.get("every"), "wait", "i64")
        self._set(b.at(b.get("duration"), b.integer("mul", self.taken, b.get("t_lane"))), "clock", "ptr")
        self._set(b.at(b.get("u"), b.integer("mul", self.taken, b.get("u_lane"))), "input", "ptr")
        self._set(b.get("first_step"), "step")
        self._set("0.0", "attempts")
        self._set(b.get("burst"), "budget")
        for name, base in (("law", "law"), ("row_in", "rows_in"), ("numbers", "numbers"), ("row_out", "rows_out")):
            stride = b.get({"row_in": "in", "row_out": "out"}.get(name, name) + "_lane")
            self._set(b.at(b.get(base), b.integer("mul", self.taken, stride)), name, "ptr")
        stride = b.get("p_lane")
        b.branch(b.do(f"icmp eq i64 {stride}, 0"), "interval", "parameters")
        b.write("parameters:")
        source = b.at(b.get("p"), b.integer("mul", self.taken, stride))
        for i in range(self.frame.parameters):
            self._set(b.load(source, i), "p", element=i)
        b.write("call void @prepare(ptr %frame)")
        b.write("br label %interval")

    def _interval(self) -> None:
        b, m = self.b, self.frame.inputs
        b.write("interval:")
        row = b.do(f"phi i64 [{self.after}, %onward], [0, %begin], [0, %parameters]")
        self._set(row, "row", "i64")
        clock = self._get("clock", "ptr")
        left = b.load(clock, 0)
        self._set(left, "left")
        self._set(b.at(clock, 1), "clock", "ptr")
        earned = b.do(f"fmul double {b.get('rate')}, {left}")
        budget = b.do(f"fadd double {self._get('budget')}, {earned}")
        self._set(budget, "budget")
        limit = b.do(f"fadd double {self._get('attempts')}, {b.get('cap')}")
        less = b.do(f"fcmp olt double {limit}, {budget}")
        self._set(b.do(f"select i1 {less}, double {limit}, double {budget}"), "limit")
        sample = b.get("sample")
        b.branch(b.do(f"icmp eq ptr {sample}, null"), "open", "closed")
        b.write("open:")
        source = self._get("input", "ptr")
        for i in range(m):
            self._set(b.load(source, i), "u", element=i)
        self._set(b.at(source, m), "input", "ptr")
        b.write("ret i64 0")
        self._sampled(row, sample)

    def _sampled(self, row: str, sample: str) -> None:
        """A sampled law gives the inputs; its intervals are tried in one step first, as `advance` does."""
        b = self.b
        b.write("closed:")
        self._set(self._get("left"), "step")
        law = self._get("law", "ptr")
        b.branch(b.do(f"icmp eq i64 {b.integer('urem', row, b.get('parts'))}, 0"), "instant", "between")
        b.write("instant:")
        into, out = self._get("row_in", "ptr"), self._get("row_out", "ptr")
        places = ", ".join(f"ptr {place}" for place in ("%slot", law, into, self._get("numbers", "ptr"), out))
        b.write(f"call void {sample}({places})")
        self._set(b.at(into, b.get("in_row")), "row_in", "ptr")
        self._set(b.at(out, b.get("out_row")), "row_out", "ptr")
        b.write("ret i64 0")
        b.write("between:")  # the newer commands arrive inside the period; a law keeps them first among its states
        for i in range(self.frame.commands):
            self._set(b.load(law, i), "u", element=i)
        b.write("ret i64 0")


def service(frame: Frame) -> list[str]:
    """`service`, which looks after one lane between attempts."""
    head = "define internal i64 @service(ptr %job, ptr %frame, i64 %w) noinline nounwind {"
    return [head, "entry:", *_Service(frame).b.lines, "}"]
