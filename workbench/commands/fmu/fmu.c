/* A jack rig as an FMU: the plant x' = f(x, u, p), y = h(x, u, p) and, where LAW is 1, the sampled controller with its
 * guard and delay. plant.c has the graphs, model.h sizes and start values. SI units.
 *
 * Co-simulation steps as jackbench's engine does: the inputs are held over a step, each attempt of an adaptive implicit
 * step is accepted or repeated shorter. Value references count states, their derivatives, inputs, outputs, parameters. */
#include "fmi2.h"
#include "model.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DERIVATIVES = STATES, INPUTS_AT = 2 * STATES, OUTPUTS_AT = INPUTS_AT + INPUTS };
enum { PARAMETERS_AT = OUTPUTS_AT + OUTPUTS + PUT_OUT, ALL = PARAMETERS_AT + PARAMETERS };
#define EARLY (1e-9 * PERIOD) /* s by which an instant may be missed by rounding */
#define NEAR(t) (1e-5 * PERIOD + 1e-14 * fabs(t)) /* s by which a master's time may differ from this one's */

/* The state machines of FMI 2.0.4, 3.2.3 and 4.2.4. Reading is allowed in all modes. */
enum { INSTANTIATED = 1, INITIALIZING = 2, EVENTS = 4, CONTINUOUS = 8, STEPPING = 16, FAILED = 32, TERMINATED = 64 };

typedef struct {
    double began, time, x[STATES], u[INPUTS], p[PARAMETERS];
    double clock[3];            /* time left, length of the next step, attempts */
    double law[LAW_STATES];     /* the state of controller, guard and delay line */
    double held;                /* the command that the drive holds, where the controller is inside */
    double put_out[PUT_OUT + 1];
    long part;                  /* intervals of periods that have begun */
    int mode, ends;             /* where the state machine is; whether there is a time after which nothing is computed */
    double end;
} state_t;

typedef struct {
    state_t s;
    double work[WORK];
    casadi_int integers[INTEGERS];
    fmi2CallbackFunctions call;
    fmi2Type type;
    char name[64];
} model_t;

static fmi2Status complain(model_t *m, const char *what)
{
    if (m->call.logger)
        m->call.logger(m->call.componentEnvironment, m->name, fmi2Error, "logStatusError", "%s", what);
    return fmi2Error;
}

/* Whether the state machine is in none of these modes; what is called is not done then. */
static int refused(model_t *m, int modes, const char *what)
{
    if (m->s.mode & modes)
        return 0;
    complain(m, what);
    return 1;
}

/* From a mode to the next. */
static fmi2Status go(model_t *m, int from, int to, const char *what)
{
    if (refused(m, from, what))
        return fmi2Error;
    m->s.mode = to;
    return fmi2OK;
}

/* The inputs of the plant: with a controller inside, the command is what the drive holds. */
static void plant_inputs(const model_t *m, double *u)
{
    memcpy(u, m->s.u, sizeof m->s.u);
    if (LAW)
        u[0] = m->s.held;
}

static void rates(model_t *m, double *to)
{
    double u[INPUTS];
    const double *arguments[] = {m->s.x, u, m->s.p};
    double *results[] = {to};
    plant_inputs(m, u);
    plant_rates(arguments, results, m->integers, m->work, 0);
}

static void outputs(model_t *m, double *to)
{
    double u[INPUTS];
    const double *arguments[] = {m->s.x, u, m->s.p};
    double *results[] = {to};
    plant_inputs(m, u);
    plant_outputs(arguments, results, m->integers, m->work, 0);
    memcpy(to + OUTPUTS, m->s.put_out, PUT_OUT * sizeof(double));
}

#if LAW
/* When the next interval of a period begins: intervals alternate where a command arrives inside a period. */
static double next_instant(const state_t *s)
{
    return s->began + (double)(s->part / INTERVALS) * PERIOD + (s->part % INTERVALS ? durations[0] : 0.0);
}

/* What happens at an instant: readings, law, guard and delay line; inside a period the newer command arrives. */
static void instant(model_t *m)
{
    state_t *s = &m->s;
    double u[INPUTS], row[INPUTS + 1], to[INPUTS + LAW_STATES + PUT_OUT];
    const double *arguments[] = {s->x, u, s->p, s->law, row, numbers};
    double *results[] = {to};
    if (s->part++ % INTERVALS) {
        s->held = s->law[0];
        return;
    }
    plant_inputs(m, u);
    row[0] = s->u[0];
    row[1] = 0.0; /* a command that is added to the controller's */
    memcpy(row + 2, s->u + 1, (INPUTS - 1) * sizeof(double));
    plant_instant(arguments, results, m->integers, m->work, 0);
    s->held = to[0];
    memcpy(s->law, to + INPUTS, sizeof s->law);
    memcpy(s->put_out, to + INPUTS + LAW_STATES, PUT_OUT * sizeof(double));
}
#endif

/* Hold the inputs for some time; 0 where the steps become too short. */
static int hold(model_t *m, double duration)
{
    double u[INPUTS], tolerance = TOLERANCE, from[STATES + 3], to[STATES + 3];
    const double *arguments[] = {from, u, m->s.p, &tolerance};
    double *results[] = {to};
    plant_inputs(m, u);
    memcpy(from, m->s.x, sizeof m->s.x);
    memcpy(from + STATES, m->s.clock, sizeof m->s.clock);
    from[STATES] = duration;
    if (LAW) /* as a closed loop does: an interval is tried in one step first */
        from[STATES + 1] = duration;
    from[STATES + 2] = 0.0;
    while (from[STATES] > 0.0) {
        plant_attempt(arguments, results, m->integers, m->work, 0);
        memcpy(from, to, sizeof from);
        if (!(from[STATES + 1] > SMALLEST) || from[STATES + 2] > ATTEMPTS)
            return 0;
    }
    memcpy(m->s.x, from, sizeof m->s.x);
    m->s.clock[1] = from[STATES + 1];
    m->s.time += duration;
    return 1;
}

static double *place(model_t *m, fmi2ValueReference vr)
{
    if (vr < STATES)
        return &m->s.x[vr];
    if (vr >= INPUTS_AT && vr < OUTPUTS_AT)
        return &m->s.u[vr - INPUTS_AT];
    if (vr >= PARAMETERS_AT && vr < ALL)
        return &m->s.p[vr - PARAMETERS_AT];
    return NULL;
}

FMI2_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
FMI2_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

FMI2_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String *what)
{
    (void)c, (void)on, (void)n, (void)what;
    return fmi2OK;
}

static void start(model_t *m)
{
    memset(&m->s, 0, sizeof m->s);
    memcpy(m->s.x, start_x, sizeof start_x);
    memcpy(m->s.u, start_u, sizeof start_u);
    memcpy(m->s.p, start_p, sizeof start_p);
    m->s.clock[1] = FIRST_STEP;
    m->s.mode = INSTANTIATED;
#if LAW
    memcpy(m->s.law, start_law, sizeof start_law);
    m->s.held = start_law[0];
#endif
}

FMI2_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                          const fmi2CallbackFunctions *call, fmi2Boolean visible, fmi2Boolean logging)
{
    model_t *m = calloc(1, sizeof *m);
    (void)resources, (void)visible, (void)logging;
    if (!m)
        return NULL;
    m->type = type;
    if (call)
        m->call = *call;
    strncpy(m->name, name ? name : "", sizeof m->name - 1);
    if (!guid || strcmp(guid, GUID)) {
        complain(m, "the model description is of another FMU");
        free(m);
        return NULL;
    }
    start(m);
    return m;
}

FMI2_EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

FMI2_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean given, fmi2Real tolerance, fmi2Real time,
                                           fmi2Boolean ends, fmi2Real end)
{
    model_t *m = c;
    (void)given, (void)tolerance;
    if (refused(m, INSTANTIATED, "fmi2SetupExperiment: comes before the initialisation"))
        return fmi2Error;
    m->s.time = m->s.began = time;
    m->s.ends = ends;
    m->s.end = end;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return go(c, INSTANTIATED, INITIALIZING, "fmi2EnterInitializationMode: is for a new or a reset instance");
}

FMI2_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    const int next = ((model_t *)c)->type == fmi2CoSimulation ? STEPPING : EVENTS;
    return go(c, INITIALIZING, next, "fmi2ExitInitializationMode: comes after fmi2EnterInitializationMode");
}

FMI2_EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    return go(c, EVENTS | CONTINUOUS | STEPPING | FAILED, TERMINATED, "fmi2Terminate: comes after the initialisation");
}

FMI2_EXPORT fmi2Status fmi2Reset(fmi2Component c) { start(c); return fmi2OK; }

FMI2_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference *vr, size_t n, fmi2Real *value)
{
    model_t *m = c;
    double y[OUTPUTS + PUT_OUT], dx[STATES];
    int with_y = 0, with_dx = 0;
    for (size_t i = 0; i < n; i++) {
        const double *at = place(m, vr[i]);
        if (vr[i] >= ALL)
            return complain(m, "no variable of this value reference");
        if (!at && vr[i] < INPUTS_AT) {
            if (!with_dx++)
                rates(m, dx);
            at = &dx[vr[i] - DERIVATIVES];
        } else if (!at) {
            if (!with_y++)
                outputs(m, y);
            at = &y[vr[i] - OUTPUTS_AT];
        }
        value[i] = *at;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference *vr, size_t n, const fmi2Real *value)
{
    const int started = !(((model_t *)c)->s.mode & (INSTANTIATED | INITIALIZING));
    if (refused(c, ~(FAILED | TERMINATED), "fmi2SetReal: nothing is set after an error or the end"))
        return fmi2Error;
    for (size_t i = 0; i < n; i++) {
        if (!place(c, vr[i]))
            return complain(c, "a variable that is computed cannot be set");
        if (vr[i] >= PARAMETERS_AT && constant_p[vr[i] - PARAMETERS_AT] != 0.0)
            return complain(c, "a constant cannot be set");
        if (started && !(vr[i] >= INPUTS_AT && vr[i] < OUTPUTS_AT))
            return complain(c, "after the initialisation only inputs are set: parameters are fixed, states are exact");
        if (!isfinite(value[i]))
            return complain(c, "a value that is set must be finite");
    }
    for (size_t i = 0; i < n; i++)
        *place(c, vr[i]) = value[i];
    return fmi2OK;
}

#define NO_VARIABLES(NAME, TYPE)                                                                                       \
    FMI2_EXPORT fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2ValueReference *vr, size_t n, TYPE *value)         \
    {                                                                                                                  \
        (void)vr, (void)value;                                                                                         \
        return n ? complain(c, "no variables of this type") : fmi2OK;                                                  \
    }                                                                                                                  \
    FMI2_EXPORT fmi2Status fmi2Set##NAME(fmi2Component c, const fmi2ValueReference *vr, size_t n, const TYPE *value)   \
    {                                                                                                                  \
        (void)vr, (void)value;                                                                                         \
        return n ? complain(c, "no variables of this type") : fmi2OK;                                                  \
    }
NO_VARIABLES(Integer, fmi2Integer)
NO_VARIABLES(Boolean, fmi2Boolean)
NO_VARIABLES(String, fmi2String)

FMI2_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!*state && !(*state = malloc(sizeof(state_t))))
        return complain(c, "out of memory");
    memcpy(*state, &((model_t *)c)->s, sizeof(state_t));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    memcpy(&((model_t *)c)->s, state, sizeof(state_t));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(state_t);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    if (size < sizeof(state_t))
        return complain(c, "too little room for a state");
    memcpy(bytes, state, sizeof(state_t));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    if (size < sizeof(state_t) || (!*state && !(*state = malloc(sizeof(state_t)))))
        return complain(c, "not the bytes of a state");
    memcpy(*state, bytes, sizeof(state_t));
    return fmi2OK;
}

/* Of derivatives and outputs along a direction of states and inputs; commands are discrete, so they stand still. */
FMI2_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference *unknown, size_t n,
                                                    const fmi2ValueReference *known, size_t k, const fmi2Real *along,
                                                    fmi2Real *slope)
{
    model_t *m = c;
    double u[INPUTS], dx[STATES] = {0}, du[INPUTS] = {0}, df[STATES], dy[OUTPUTS + PUT_OUT] = {0};
    const double *arguments[] = {m->s.x, u, m->s.p, dx, du};
    double *results[] = {df, dy};
    plant_inputs(m, u);
    for (size_t i = 0; i < k; i++) {
        if (known[i] < STATES)
            dx[known[i]] = along[i];
        else if (known[i] >= INPUTS_AT && known[i] < OUTPUTS_AT)
            du[known[i] - INPUTS_AT] = along[i];
        else
            return complain(m, "derivatives are along states and inputs");
    }
    if (LAW)
        du[0] = 0.0;
    plant_along(arguments, results, m->integers, m->work, 0);
    for (size_t i = 0; i < n; i++) {
        if (unknown[i] >= DERIVATIVES && unknown[i] < INPUTS_AT)
            slope[i] = df[unknown[i] - DERIVATIVES];
        else if (unknown[i] >= OUTPUTS_AT && unknown[i] < PARAMETERS_AT)
            slope[i] = dy[unknown[i] - OUTPUTS_AT];
        else
            return complain(m, "derivatives are of derivatives and outputs");
    }
    return fmi2OK;
}

/* Co-simulation */

/* A step that ended on its way: only a state that was kept, or a reset, helps. */
static fmi2Status fail(model_t *m)
{
    m->s.mode = FAILED;
    return complain(m, "the steps became too short");
}

FMI2_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_return)
{
    model_t *m = c;
    const double end = time + step;
    (void)no_return;
    if (refused(m, STEPPING, "fmi2DoStep: comes after the initialisation, and not after an error or the end"))
        return fmi2Error;
    if (!(step > 0.0) || !isfinite(end))
        return complain(m, "fmi2DoStep: a communication step must be longer than 0, and finite");
    if (fabs(time - m->s.time) > NEAR(time))
        return complain(m, "fmi2DoStep: a step begins where the last one ended, or at the start time");
    if (m->s.ends && end > m->s.end + NEAR(end))
        return complain(m, "fmi2DoStep: the step goes beyond the stop time of fmi2SetupExperiment");
#if LAW
    while (next_instant(&m->s) < end - EARLY) {
        if (next_instant(&m->s) > m->s.time + EARLY && !hold(m, next_instant(&m->s) - m->s.time))
            return fail(m);
        instant(m);
    }
#endif
    if (end > m->s.time && !hold(m, end - m->s.time))
        return fail(m);
    m->s.time = end;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { return complain(c, "steps do not wait"); }

FMI2_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference *vr, size_t n,
                                                   const fmi2Integer *order, const fmi2Real *value)
{
    (void)vr, (void)n, (void)order, (void)value;
    return complain(c, "inputs are held over a step");
}

FMI2_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference *vr, size_t n,
                                                    const fmi2Integer *order, fmi2Real *value)
{
    (void)vr, (void)n, (void)order, (void)value;
    return complain(c, "outputs have no derivatives here");
}

#define NO_STATUS(NAME, TYPE)                                                                                          \
    FMI2_EXPORT fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2StatusKind kind, TYPE *value)                      \
    {                                                                                                                  \
        (void)c, (void)kind, (void)value;                                                                              \
        return fmi2Discard;                                                                                            \
    }
NO_STATUS(Status, fmi2Status)
NO_STATUS(RealStatus, fmi2Real)
NO_STATUS(IntegerStatus, fmi2Integer)
NO_STATUS(BooleanStatus, fmi2Boolean)
NO_STATUS(StringStatus, fmi2String)

/* Model exchange */

FMI2_EXPORT fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    return go(c, EVENTS | CONTINUOUS, EVENTS, "fmi2EnterEventMode: comes from continuous time");
}

FMI2_EXPORT fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    return go(c, EVENTS, CONTINUOUS, "fmi2EnterContinuousTimeMode: comes from event mode");
}

FMI2_EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    model_t *m = c;
    memset(info, 0, sizeof *info);
    if (refused(m, EVENTS, "fmi2NewDiscreteStates: is for event mode"))
        return fmi2Error;
#if LAW
    while (next_instant(&m->s) <= m->s.time + EARLY)
        instant(m);
    info->nextEventTimeDefined = fmi2True;
    info->nextEventTime = next_instant(&m->s);
#endif
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean *event,
                                                   fmi2Boolean *stop)
{
    (void)no_set;
    *event = *stop = fmi2False;
    return go(c, CONTINUOUS, CONTINUOUS, "fmi2CompletedIntegratorStep: is for continuous time");
}

FMI2_EXPORT fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    if (refused(c, EVENTS | CONTINUOUS, "fmi2SetTime: comes after the initialisation, in model exchange"))
        return fmi2Error;
    ((model_t *)c)->s.time = time;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real *x, size_t n)
{
    if (refused(c, CONTINUOUS, "fmi2SetContinuousStates: is for continuous time"))
        return fmi2Error;
    if (n != STATES)
        return complain(c, "fmi2SetContinuousStates: not as many as there are");
    memcpy(((model_t *)c)->s.x, x, n * sizeof(double));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real *x, size_t n)
{
    memcpy(x, ((model_t *)c)->s.x, n * sizeof(double));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real *to, size_t n)
{
    (void)n;
    rates(c, to);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real *to, size_t n)
{
    (void)c, (void)to, (void)n;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real *to, size_t n)
{
    (void)c;
    memcpy(to, nominal_x, n * sizeof(double));
    return fmi2OK;
}
