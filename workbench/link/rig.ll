; One served rig as machine code: a period of it, and what comes and goes over its socket, with no Python between.
;
; Four shorthands are expanded by machine_code.py: `%v = get FIELD` and `set FIELD, VALUE` load and store a field of the
; job; `%v = at TYPE %base, INDEX` and `put TYPE VALUE, %base, INDEX` an element of an array whose elements have 8 bytes.

declare i64 @recvfrom(i32, ptr, i64, i32, ptr, ptr)
declare i64 @sendto(i32, ptr, i64, i32, ptr, i32)
declare i32 @pselect(i32, ptr, ptr, ptr, ptr, ptr)
declare i32 @clock_gettime(i32, ptr)
declare i32 @memcmp(ptr, ptr, i64)
declare double @llvm.rint.f64(double)
declare double @llvm.fabs.f64(double)

; Time [ns] of the monotonic clock.
define internal i64 @clock(ptr %job) nounwind {
entry:
  %spec = alloca [2 x i64]
  %id64 = get clock_id
  %id = trunc i64 %id64 to i32
  %done = call i32 @clock_gettime(i32 %id, ptr %spec)
  %s = at i64 %spec, 0
  %ns = at i64 %spec, 1
  %whole = mul i64 %s, 1000000000
  %now = add i64 %whole, %ns
  ret i64 %now
}

; One more in a table of `bins` counts, at a time in units of `unit` ns; the last bin has all that are longer.
define internal void @count(ptr %table, i64 %bins, i64 %ns, i64 %unit) nounwind {
entry:
  %raw = sdiv i64 %ns, %unit
  %last = sub i64 %bins, 1
  %long = icmp sgt i64 %raw, %last
  %short = select i1 %long, i64 %last, i64 %raw
  %early = icmp slt i64 %short, 0
  %bin = select i1 %early, i64 0, i64 %short
  %n = at i64 %table, %bin
  %more = add i64 %n, 1
  put i64 %more, %table, %bin
  ret void
}

; Read all sensors now; the reading is ready to be sent. Beyond a limit a rig that is on has tripped.
define void @sample(ptr %job) nounwind {
entry:
  %outputs = get outputs
  %next = get output_next
  put i64 0, %next, 0
  %output_job = get output_job
  call void %outputs(ptr %output_job)
  %y = get y
  %columns = get columns
  %noise = get noise
  %resolution = get resolution
  %normal = get normal
  %row = get normal_row
  %channels = get channels
  %first = mul i64 %row, %channels
  %after_row = add i64 %row, 1
  set normal_row, %after_row
  %reading = get reading
  br label %each
each:
  %i = phi i64 [0, %entry], [%i1, %keep]
  %more = icmp slt i64 %i, %channels
  br i1 %more, label %read, label %judge
read:
  %column = at i64 %columns, %i
  %true = at double %y, %column
  %sigma = at double %noise, %i
  %place = add i64 %first, %i
  %draw = at double %normal, %place
  %off = fmul double %sigma, %draw
  %noisy = fadd double %true, %off
  %step = at double %resolution, %i
  %coarse = fcmp ogt double %step, 0.0
  br i1 %coarse, label %round, label %keep
round:
  %ratio = fdiv double %noisy, %step
  %steps = call double @llvm.rint.f64(double %ratio)
  %rounded = fmul double %steps, %step
  br label %keep
keep:
  %value = phi double [%noisy, %read], [%rounded, %round]
  %bytes = mul i64 %i, 8
  %offset = add i64 %bytes, 20
  %target = getelementptr i8, ptr %reading, i64 %offset
  store double %value, ptr %target, align 1
  %i1 = add i64 %i, 1
  br label %each
judge:
  %state = get state
  %on = icmp eq i64 %state, 1
  br i1 %on, label %limit, label %written
limit:
  %limits = get limits
  %limit_column = get limit_column
  %limit_middle = get limit_middle
  %limit_size = get limit_size
  br label %watch
watch:
  %j = phi i64 [0, %limit], [%j1, %within]
  %some = icmp slt i64 %j, %limits
  br i1 %some, label %test, label %written
test:
  %which = at i64 %limit_column, %j
  %is = at double %y, %which
  %middle = at double %limit_middle, %j
  %size = at double %limit_size, %j
  %away = fsub double %is, %middle
  %far = call double @llvm.fabs.f64(double %away)
  %inside = fcmp ole double %far, %size
  %j1 = add i64 %j, 1
  br i1 %inside, label %within, label %trip
within:
  br label %watch
trip:
  set state, 2
  set trip, %j1
  br label %written
written:
  %now_state = get state
  %shifted = icmp eq i64 %now_state, 2
  %is_on = icmp eq i64 %now_state, 1
  %bit1 = zext i1 %is_on to i64
  %two = select i1 %shifted, i64 2, i64 0
  %bits = or i64 %bit1, %two
  %flags = get flags
  %status64 = or i64 %bits, %flags
  %status = trunc i64 %status64 to i8
  %at7 = getelementptr i8, ptr %reading, i64 7
  store i8 %status, ptr %at7
  %sequence64 = get sequence
  %sequence = trunc i64 %sequence64 to i32
  %at8 = getelementptr i8, ptr %reading, i64 8
  store i32 %sequence, ptr %at8, align 1
  %tick = get tick
  %at12 = getelementptr i8, ptr %reading, i64 12
  store i64 %tick, ptr %at12, align 1
  ret void
}

; Hold the inputs for `duration`; the state is moved, or the rig has tripped with no number of a limit.
define internal void @hold(ptr %job, double %duration) nounwind {
entry:
  %run = get run
  %run_job = get run_job
  %durations = get duration
  put double %duration, %durations, 0
  %first_step = get first_step
  put double %duration, %first_step, 0
  %next = get run_next
  put i64 0, %next, 0
  call void %run(ptr %run_job)
  %failed = get failed
  %row = at i64 %failed, 0
  %well = icmp slt i64 %row, 0
  br i1 %well, label %move, label %stop
move:
  %x = get x
  %reached = get reached
  %n = get states
  br label %each
each:
  %i = phi i64 [0, %move], [%i1, %copy]
  %more = icmp slt i64 %i, %n
  br i1 %more, label %copy, label %done
copy:
  %value = at double %reached, %i
  put double %value, %x, %i
  %i1 = add i64 %i, 1
  br label %each
stop:
  put i64 -1, %failed, 0
  set state, 2
  set trip, -1
  ret void
done:
  ret void
}

; After a trip the shut-off valves close by one more period, to what they leak.
define internal void @shut(ptr %job) nounwind {
entry:
  %m = get commands
  %places = get valve_place
  %opened = get valve_open
  %leaks = get valve_leak
  %times = get valve_time
  %p = get p
  %period = get period
  %closed = get closed
  %half = fadd double %closed, 0.5
  %since = fmul double %half, %period
  %closed1 = fadd double %closed, 1.0
  set closed, %closed1
  br label %each
each:
  %i = phi i64 [0, %entry], [%i1, %next]
  %more = icmp slt i64 %i, %m
  br i1 %more, label %valve, label %done
valve:
  %place = at i64 %places, %i
  %i1 = add i64 %i, 1
  %there = icmp sge i64 %place, 0
  br i1 %there, label %close, label %next
close:
  %leak = at double %leaks, %i
  %time = at double %times, %i
  %open = at double %opened, %i
  %range = fsub double 1.0, %leak
  %gone = fmul double %range, %since
  %share = fdiv double %gone, %time
  %left = fsub double 1.0, %share
  %shut = fcmp oge double %since, %time
  %passes = select i1 %shut, double %leak, double %left
  %number = fmul double %open, %passes
  put double %number, %p, %place
  br label %next
next:
  br label %each
done:
  ret void
}

; One period: the demanded commands limited in size and rate, held back by the delay, the plant moved on.
define void @step(ptr %job) nounwind {
entry:
  %condition = get state
  %tripped = icmp eq i64 %condition, 2
  br i1 %tripped, label %trips, label %begin
trips:
  call void @shut(ptr %job)
  br label %begin
begin:
  %m = get commands
  %demanded = get demanded
  %command = get command
  %low = get low
  %high = get high
  %rate = get rate
  set limited, 0
  br label %limit
limit:
  %i = phi i64 [0, %begin], [%i1, %same]
  %more = icmp slt i64 %i, %m
  br i1 %more, label %each, label %shift
each:
  %asked = at double %demanded, %i
  %least = at double %low, %i
  %most = at double %high, %i
  %under = fcmp olt double %asked, %least
  %a1 = select i1 %under, double %least, double %asked
  %over = fcmp ogt double %a1, %most
  %target = select i1 %over, double %most, double %a1
  %last = at double %command, %i
  %largest = at double %rate, %i
  %move = fsub double %target, %last
  %fast = fcmp ogt double %move, %largest
  %up = fadd double %last, %largest
  %b1 = select i1 %fast, double %up, double %target
  %back = fneg double %largest
  %slow = fcmp olt double %move, %back
  %down = fsub double %last, %largest
  %sent = select i1 %slow, double %down, double %b1
  put double %sent, %command, %i
  %gap = fsub double %sent, %asked
  %size = call double @llvm.fabs.f64(double %gap)
  %changed = fcmp ogt double %size, 1.0e-12
  br i1 %changed, label %mark, label %same
mark:
  set limited, 1
  br label %same
same:
  %i1 = add i64 %i, 1
  br label %limit
shift:
  ; line [late + 2, m]: the commands on their way, the oldest first; the last row takes the new one.
  %line = get line
  %late = get late
  %rows = add i64 %late, 1
  %kept = mul i64 %rows, %m
  br label %older
older:
  %k = phi i64 [0, %shift], [%k1, %down_one]
  %left = icmp slt i64 %k, %kept
  br i1 %left, label %down_one, label %newest
down_one:
  %from = add i64 %k, %m
  %value = at double %line, %from
  put double %value, %line, %k
  %k1 = add i64 %k, 1
  br label %older
newest:
  %c = phi i64 [0, %older], [%c1, %append]
  %lasting = icmp slt i64 %c, %m
  br i1 %lasting, label %append, label %parts
append:
  %new = at double %command, %c
  %end = add i64 %kept, %c
  put double %new, %line, %end
  %c1 = add i64 %c, 1
  br label %newest
parts:
  %u = get u
  %first = get first_part
  %second = get second_part
  %interpolated = get interpolated
  %period = get period
  %mean = icmp ne i64 %interpolated, 0
  br i1 %mean, label %blend, label %split
blend:
  %share = get part
  %rest = fsub double 1.0, %share
  br label %blending
blending:
  %d = phi i64 [0, %blend], [%d1, %mixed]
  %d_more = icmp slt i64 %d, %m
  br i1 %d_more, label %mixed, label %whole
mixed:
  %before = at double %line, %d
  %next_place = add i64 %d, %m
  %after = at double %line, %next_place
  %w1 = fmul double %share, %before
  %w2 = fmul double %rest, %after
  %both = fadd double %w1, %w2
  put double %both, %u, %d
  %d1 = add i64 %d, 1
  br label %blending
whole:
  call void @hold(ptr %job, double %period)
  ret void
split:
  %late_part = fcmp ogt double %first, 0.0
  br i1 %late_part, label %olds, label %news
olds:
  %e = phi i64 [0, %split], [%e1, %old]
  %e_more = icmp slt i64 %e, %m
  br i1 %e_more, label %old, label %held_old
old:
  %old_value = at double %line, %e
  put double %old_value, %u, %e
  %e1 = add i64 %e, 1
  br label %olds
held_old:
  call void @hold(ptr %job, double %first)
  br label %news
news:
  %g = phi i64 [0, %split], [0, %held_old], [%g1, %young]
  %g_more = icmp slt i64 %g, %m
  br i1 %g_more, label %young, label %held_new
young:
  %g_place = add i64 %g, %m
  %young_value = at double %line, %g_place
  put double %young_value, %u, %g
  %g1 = add i64 %g, 1
  br label %news
held_new:
  call void @hold(ptr %job, double %second)
  ret void
}

; Nothing is demanded.
define internal void @release(ptr %job) nounwind {
entry:
  %m = get commands
  %demanded = get demanded
  br label %each
each:
  %i = phi i64 [0, %entry], [%i1, %zero]
  %more = icmp slt i64 %i, %m
  br i1 %more, label %zero, label %done
zero:
  put double 0.0, %demanded, %i
  %i1 = add i64 %i, 1
  br label %each
done:
  ret void
}

; One datagram into `packet`, its sender into `address`; how long it is, negative where there is none.
define internal i64 @receive(ptr %job, i64 %flags64) nounwind {
entry:
  %fd64 = get socket
  %fd = trunc i64 %fd64 to i32
  %packet = get packet
  %address = get address
  %flags = trunc i64 %flags64 to i32
  %size = alloca i64
  store i64 128, ptr %size
  %n = call i64 @recvfrom(i32 %fd, ptr %packet, i64 2048, i32 %flags, ptr %address, ptr %size)
  %long = load i64, ptr %size
  set address_length, %long
  set length, %n
  ret i64 %n
}

; What a datagram is: 0 nothing for a rig, 1 a command of the owner that can be taken, 2 a matter for Python.
define internal i64 @judge(ptr %job) nounwind {
entry:
  %n = get length
  %packet = get packet
  %enough = icmp sge i64 %n, 7
  br i1 %enough, label %magic, label %nothing
magic:
  %four = load i32, ptr %packet, align 1
  %at4 = getelementptr i8, ptr %packet, i64 4
  %two = load i16, ptr %at4, align 1
  %jbri = icmp eq i32 %four, 1230127690
  %g1 = icmp eq i16 %two, 327
  %ours = and i1 %jbri, %g1
  br i1 %ours, label %kind, label %nothing
kind:
  %at6 = getelementptr i8, ptr %packet, i64 6
  %which = load i8, ptr %at6
  switch i8 %which, label %nothing [i8 0, label %python i8 2, label %form i8 4, label %python]
form:
  %m = get commands
  %body = mul i64 %m, 8
  %whole = add i64 %body, 11
  %right = icmp eq i64 %n, %whole
  br i1 %right, label %owner, label %python
owner:
  %address = get address
  %own = get owner
  %length = get owner_length
  %its = get address_length
  %as_long = icmp eq i64 %length, %its
  br i1 %as_long, label %compare, label %python
compare:
  %differ = call i32 @memcmp(ptr %address, ptr %own, i64 %length)
  %same = icmp eq i32 %differ, 0
  %state = get state
  %off = icmp eq i64 %state, 0
  %not_off = xor i1 %off, true
  %heard = and i1 %same, %not_off
  br i1 %heard, label %values, label %python
values:
  %i = phi i64 [0, %compare], [%i1, %finite]
  %more = icmp slt i64 %i, %m
  br i1 %more, label %each, label %command
each:
  %bytes = mul i64 %i, 8
  %offset = add i64 %bytes, 11
  %place = getelementptr i8, ptr %packet, i64 %offset
  %value = load double, ptr %place, align 1
  %zero = fsub double %value, %value
  %is_finite = fcmp oeq double %zero, 0.0
  br i1 %is_finite, label %finite, label %python
finite:
  %i1 = add i64 %i, 1
  br label %values
command:
  ret i64 1
python:
  ret i64 2
nothing:
  ret i64 0
}

; The values of a command are demanded; none where the rig has tripped.
define internal void @take(ptr %job) nounwind {
entry:
  %packet = get packet
  %at7 = getelementptr i8, ptr %packet, i64 7
  %sequence = load i32, ptr %at7, align 1
  %wide = zext i32 %sequence to i64
  set sequence, %wide
  %state = get state
  %on = icmp eq i64 %state, 1
  br i1 %on, label %copy, label %none
none:
  call void @release(ptr %job)
  ret void
copy:
  %m = get commands
  %demanded = get demanded
  br label %each
each:
  %i = phi i64 [0, %copy], [%i1, %one]
  %more = icmp slt i64 %i, %m
  br i1 %more, label %one, label %done
one:
  %bytes = mul i64 %i, 8
  %offset = add i64 %bytes, 11
  %place = getelementptr i8, ptr %packet, i64 %offset
  %value = load double, ptr %place, align 1
  put double %value, %demanded, %i
  %i1 = add i64 %i, 1
  br label %each
done:
  ret void
}

; Send the reading to the owner.
define void @answer(ptr %job) nounwind {
entry:
  %fd64 = get socket
  %fd = trunc i64 %fd64 to i32
  %reading = get reading
  %size = get reading_size
  %owner = get owner
  %length64 = get owner_length
  %length = trunc i64 %length64 to i32
  %flags64 = get dontwait
  %flags = trunc i64 %flags64 to i32
  %sent = call i64 @sendto(i32 %fd, ptr %reading, i64 %size, i32 %flags, ptr %owner, i32 %length)
  ret void
}

define internal void @drop(ptr %job) nounwind {
entry:
  %n = get dropped
  %n1 = add i64 %n, 1
  set dropped, %n1
  ret void
}

; Bit 16 after a step whose command was limited, and no other.
define internal void @flag_limited(ptr %job, i64 %others) nounwind {
entry:
  %limited = get limited
  %bit = mul i64 %limited, 16
  %flags = or i64 %bit, %others
  set flags, %flags
  ret void
}

; Paced by the client, until Python has something to do: 0 it was asked to, 1 a datagram for it, 2 noise runs out.
define i64 @lockstep(ptr %job) nounwind {
entry:
  br label %wait
wait:
  %attention = get attention
  %asked = icmp ne i64 %attention, 0
  br i1 %asked, label %leave, label %listen
listen:
  %n = call i64 @receive(ptr %job, i64 0)
  %some = icmp sge i64 %n, 0
  br i1 %some, label %look, label %wait
look:
  %what = call i64 @judge(ptr %job)
  switch i64 %what, label %python [i64 0, label %drop i64 1, label %command]
drop:
  call void @drop(ptr %job)
  br label %wait
command:
  %packet = get packet
  %at7 = getelementptr i8, ptr %packet, i64 7
  %its32 = load i32, ptr %at7, align 1
  %its = zext i32 %its32 to i64
  %last = get sequence
  %again = icmp eq i64 %its, %last
  br i1 %again, label %repeat, label %next
repeat:
  call void @answer(ptr %job)
  br label %wait
next:
  %one_more = add i64 %last, 1
  %due = and i64 %one_more, 4294967295
  %right = icmp eq i64 %its, %due
  br i1 %right, label %go, label %python
go:
  call void @take(ptr %job)
  call void @step(ptr %job)
  call void @flag_limited(ptr %job, i64 0)
  %tick = get tick
  %tick1 = add i64 %tick, 1
  set tick, %tick1
  %periods = get periods
  %periods1 = add i64 %periods, 1
  set periods, %periods1
  call void @sample(ptr %job)
  call void @answer(ptr %job)
  %row = get normal_row
  %rows = get normal_rows
  %out = icmp sge i64 %row, %rows
  br i1 %out, label %refill, label %wait
leave:
  ret i64 0
python:
  ret i64 1
refill:
  ret i64 2
}

; A datagram that came in real time: 1 where Python has to see it; of strangers, and of old commands, at most one in a
; period. Taken is what is ahead of the last command by at most 65,536, and in the first 100 periods no sequence number
; beyond 100 and the periods gone: that is an old session's.
define internal i64 @heard(ptr %job, i64 %now) nounwind {
entry:
  %what = call i64 @judge(ptr %job)
  switch i64 %what, label %python [i64 0, label %drop i64 1, label %command]
drop:
  call void @drop(ptr %job)
  ret i64 0
command:
  %packet = get packet
  %at7 = getelementptr i8, ptr %packet, i64 7
  %its = load i32, ptr %at7, align 1
  %last64 = get sequence
  %last = trunc i64 %last64 to i32
  %ahead = sub i32 %its, %last
  %newer = icmp sgt i32 %ahead, 0
  br i1 %newer, label %bounded, label %overtaken
overtaken:
  set overtaken, 1
  br label %refused
bounded:
  %leap = icmp ugt i32 %ahead, 65536
  %tick = get tick
  %wide = zext i32 %its to i64
  %since = add i64 %tick, 100
  %young = icmp slt i64 %tick, 100
  %early = icmp sgt i64 %wide, %since
  %stale = and i1 %young, %early
  %old = or i1 %leap, %stale
  br i1 %old, label %refused, label %take
take:
  call void @take(ptr %job)
  set fresh, 1
  set arrived, %now
  ret i64 0
python:
  %address = get address
  %own = get owner
  %length = get owner_length
  %differ = call i32 @memcmp(ptr %address, ptr %own, i64 %length)
  %same = icmp eq i32 %differ, 0
  %some = icmp sgt i64 %length, 0
  %owner = and i1 %same, %some
  br i1 %owner, label %matter, label %stranger
matter:
  ret i64 1
refused:
  %this = get periods
  %told = get refused
  %again = icmp eq i64 %this, %told
  br i1 %again, label %drop, label %tell
tell:
  set refused, %this
  ret i64 1
stranger:
  %period = get periods
  %asked = get asked
  %twice = icmp eq i64 %period, %asked
  br i1 %twice, label %drop, label %first
first:
  set asked, %period
  ret i64 1
}

; The command of this instant, and its flags: a fresh one, the last one again, or none where the client fell silent.
define internal void @choose(ptr %job, i64 %due) nounwind {
entry:
  %fresh = get fresh
  %new = icmp ne i64 %fresh, 0
  br i1 %new, label %applied, label %silent
applied:
  %arrived = get arrived
  %age = sub i64 %due, %arrived
  %ages = get ages
  %bins = get age_bins
  call void @count(ptr %ages, i64 %bins, i64 %age, i64 1000)
  set silent, 0
  set fresh, 0
  %overtaken = get overtaken
  %late_bit = mul i64 %overtaken, 8
  set overtaken, 0
  call void @flag_limited(ptr %job, i64 %late_bit)
  ret void
silent:
  %quiet = get silent
  %quiet1 = add i64 %quiet, 1
  set silent, %quiet1
  %sequence = get sequence
  %begun = icmp ne i64 %sequence, 0
  %late = select i1 %begun, i64 8, i64 0
  %watchdog = get watchdog
  %fires = icmp sge i64 %quiet1, %watchdog
  br i1 %fires, label %fire, label %same
same:
  call void @flag_limited(ptr %job, i64 %late)
  ret void
fire:
  call void @release(ptr %job)
  %both = or i64 %late, 4
  call void @flag_limited(ptr %job, i64 %both)
  ret void
}

; How late it is now, against what was due; by a whole period is missed.
define internal void @late(ptr %job, i64 %due) nounwind {
entry:
  %now = call i64 @clock(ptr %job)
  %jitter = sub i64 %now, %due
  %table = get jitter
  %bins = get jitter_bins
  call void @count(ptr %table, i64 %bins, i64 %jitter, i64 1000)
  %worst = get worst
  %higher = icmp sgt i64 %jitter, %worst
  %worst1 = select i1 %higher, i64 %jitter, i64 %worst
  set worst, %worst1
  %period_ns = get period_ns
  %missed = icmp sge i64 %jitter, %period_ns
  br i1 %missed, label %miss, label %done
miss:
  %misses = get missed
  %misses1 = add i64 %misses, 1
  set missed, %misses1
  ret void
done:
  ret void
}

; Nothing but the clock, for `readings` periods: what this machine itself misses.
define void @idle(ptr %job) nounwind {
entry:
  %spec = alloca [2 x i64]
  br label %top
top:
  %now = call i64 @clock(ptr %job)
  %due = get due
  %rest = sub i64 %due, %now
  %early = icmp sgt i64 %rest, 0
  br i1 %early, label %wait, label %instant
wait:
  %seconds = sdiv i64 %rest, 1000000000
  %ns = srem i64 %rest, 1000000000
  put i64 %seconds, %spec, 0
  put i64 %ns, %spec, 1
  %ready = call i32 @pselect(i32 0, ptr null, ptr null, ptr null, ptr %spec, ptr null)
  br label %top
instant:
  call void @late(ptr %job, i64 %due)
  %length = get period_ns
  %due1 = add i64 %due, %length
  set due, %due1
  %left = get readings
  %left1 = sub i64 %left, 1
  set readings, %left1
  %more = icmp sgt i64 %left1, 0
  br i1 %more, label %top, label %done
done:
  ret void
}

; Paced by the clock, until Python has something to do: the same answers as `lockstep`.
define i64 @realtime(ptr %job) nounwind {
entry:
  %bits = alloca [16 x i64]
  %spec = alloca [2 x i64]
  br label %top
top:
  %attention = get attention
  %asked = icmp ne i64 %attention, 0
  br i1 %asked, label %leave, label %time
time:
  %now = call i64 @clock(ptr %job)
  %due = get due
  %rest = sub i64 %due, %now
  %early = icmp sgt i64 %rest, 0
  br i1 %early, label %wait, label %drain
wait:
  %fd64 = get socket
  %fd = trunc i64 %fd64 to i32
  %nfds = add i32 %fd, 1
  %word = lshr i64 %fd64, 6
  %place = and i64 %fd64, 63
  %bit = shl i64 1, %place
  br label %clear
clear:
  %w = phi i64 [0, %wait], [%w1, %clear]
  put i64 0, %bits, %w
  %w1 = add i64 %w, 1
  %words = icmp slt i64 %w1, 16
  br i1 %words, label %clear, label %select
select:
  put i64 %bit, %bits, %word
  %seconds = sdiv i64 %rest, 1000000000
  %ns = srem i64 %rest, 1000000000
  put i64 %seconds, %spec, 0
  put i64 %ns, %spec, 1
  %ready = call i32 @pselect(i32 %nfds, ptr %bits, ptr null, ptr null, ptr %spec, ptr null)
  %some = icmp sgt i32 %ready, 0
  br i1 %some, label %listen, label %top
listen:
  %flags = get dontwait
  %n = call i64 @receive(ptr %job, i64 %flags)
  %there = icmp sge i64 %n, 0
  br i1 %there, label %look, label %top
look:
  %came = call i64 @clock(ptr %job)
  %for_python = call i64 @heard(ptr %job, i64 %came)
  %matter = icmp ne i64 %for_python, 0
  br i1 %matter, label %python, label %top
drain:
  %tries = phi i64 [0, %time], [%tries1, %drained]
  %enough = icmp sge i64 %tries, 8
  br i1 %enough, label %instant, label %more
more:
  %nowait = get dontwait
  %got = call i64 @receive(ptr %job, i64 %nowait)
  %any = icmp sge i64 %got, 0
  br i1 %any, label %drained, label %instant
drained:
  %tries1 = add i64 %tries, 1
  %wants = call i64 @heard(ptr %job, i64 %due)
  %wanted = icmp ne i64 %wants, 0
  br i1 %wanted, label %python, label %drain
instant:
  %state = get state
  %off = icmp eq i64 %state, 0
  br i1 %off, label %idle, label %serving
idle:
  call void @release(ptr %job)
  call void @flag_limited(ptr %job, i64 0)
  call void @sample(ptr %job)
  br label %move
serving:
  call void @choose(ptr %job, i64 %due)
  call void @sample(ptr %job)
  call void @answer(ptr %job)
  call void @late(ptr %job, i64 %due)
  %readings = get readings
  %readings1 = add i64 %readings, 1
  set readings, %readings1
  %tick = get tick
  %tick1 = add i64 %tick, 1
  set tick, %tick1
  %still = get state
  %on = icmp eq i64 %still, 1
  br i1 %on, label %move, label %lost
lost:
  call void @release(ptr %job)
  br label %move
move:
  call void @step(ptr %job)
  %periods = get periods
  %periods1 = add i64 %periods, 1
  set periods, %periods1
  %length = get period_ns
  %due1 = add i64 %due, %length
  %after = call i64 @clock(ptr %job)
  %behind = sub i64 %after, %due1
  %lost_grid = icmp sgt i64 %behind, 1000000000
  %fresh_grid = add i64 %after, %length
  %due2 = select i1 %lost_grid, i64 %fresh_grid, i64 %due1
  set due, %due2
  %row = get normal_row
  %rows = get normal_rows
  %out = icmp sge i64 %row, %rows
  br i1 %out, label %refill, label %top
leave:
  ret i64 0
python:
  ret i64 1
refill:
  ret i64 2
}
