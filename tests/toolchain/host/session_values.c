/* Calls with right and wrong arguments: values of variables, and derivatives. */
#include <stdlib.h>
#include <string.h>

#include "session.h"

enum { MANY = 4, NO_SUCH_REFERENCE = 1000000 };

static Outcome outcome(fmi2Status status, unsigned allowed) {
    const Outcome result = {status, allowed};
    return result;
}

/* A value that the variable may take; now and then one that is hard on the mechanism. */
static double value_for(Session *s, const Variable *v) {
    static const double WILD[] = {0.0, 2.0, 1e300, -1e300};
    double value = v->kind == 'p' || v->kind == 'f' ? v->start * between(s, 0.9, 1.1) : v->start + between(s, -0.1, 0.1);
    if (v->kind != 'f' && below(s, 25) == 0) {
        value = WILD[below(s, sizeof WILD / sizeof WILD[0])];
    }
    return value < v->minimum ? v->minimum : value > v->maximum ? v->maximum : value;
}

/* Could this value make calculations fail? */
static int is_wild(const Session *s, const Variable *v, double value) {
    const double span = v->kind == 'p' || v->kind == 'f' ? 0.11 * (v->start < 0.0 ? -v->start : v->start) : 0.11;
    const int far = value < v->start - span || value > v->start + span;
    const int bound = s->fmu->constraints > 0 || s->fmu->indicators > 0; /* starts must meet the constraints, and not
                                                                           penetrate */
    return far || (bound && v->kind != 'u');
}

Outcome try_GetReal(Session *s) {
    fmi2ValueReference references[MANY];
    double values[MANY];
    const size_t count = below(s, MANY + 1);
    const unsigned fault = count > 0 ? mistake(s, 3) : 3;
    for (size_t i = 0; i < count; i++) {
        references[i] = pick(s, "txlupfydcj")->reference;
    }
    if (fault == 0) {
        references[below(s, (unsigned)count)] = NO_SUCH_REFERENCE;
    }
    const fmi2Status status = s->fmu->GetReal(s->component, fault == 1 ? NULL : references, count,
                                              fault == 2 ? NULL : values);
    const unsigned wrong = s->model.wild ? REFUSED | DISCARDED : REFUSED; /* for whatever is met first */
    return outcome(status, fault < 3 ? wrong : calculation(s));
}

/* Sets a few variables of these kinds, rightly or not; where it is refused nothing may have changed. */
static Outcome set_some(Session *s, const char *kinds) {
    static fmi2Byte before[MAX_BYTES], after[MAX_BYTES];
    fmi2ValueReference references[MANY];
    double values[MANY];
    const Variable *variables[MANY];
    const size_t count = 1 + below(s, MANY);
    const unsigned at = below(s, (unsigned)count), fault = mistake(s, 5);
    for (size_t i = 0; i < count; i++) {
        variables[i] = pick(s, kinds);
        references[i] = variables[i]->reference;
        values[i] = value_for(s, variables[i]);
    }
    unsigned allowed = OK;
    if (fault == 0) {
        references[at] = NO_SUCH_REFERENCE;
        allowed = REFUSED;
    } else if (fault == 1) {
        values[at] = not_finite(s);
        allowed = REFUSED;
    } else if (fault == 2 && variables[at]->maximum < 1e300) {
        values[at] = variables[at]->maximum + 1.0;
        allowed = DISCARDED;
    } else if (fault == 3 && variables[at]->minimum > -1e300) {
        values[at] = variables[at]->minimum - 1.0;
        allowed = DISCARDED;
    } else if (fault == 4) {
        allowed = REFUSED;
    }
    const size_t size = s->component == NULL ? 0 : serialize(s->fmu, s->component, before);
    const fmi2Status status = s->fmu->SetReal(s->component, references, count, fault == 4 ? NULL : values);
    if (status == fmi2Discard) {
        serialize(s->fmu, s->component, after);
        expect(memcmp(before, after, size) == 0, "something was set, although the values were discarded");
    }
    for (size_t i = 0; i < count && status == fmi2OK; i++) {
        s->model.wild |= is_wild(s, variables[i], values[i]);
    }
    return outcome(status, allowed);
}

Outcome try_SetReal_input(Session *s) { return set_some(s, "u"); }
Outcome try_SetReal_state(Session *s) { return set_some(s, "xl"); }
Outcome try_SetReal_tunable(Session *s) { return set_some(s, "p"); }
Outcome try_SetReal_fixed(Session *s) { return set_some(s, "f"); }

Outcome try_SetReal_calculated(Session *s) {
    const double value = 1.0;
    return outcome(s->fmu->SetReal(s->component, &pick(s, "tcj")->reference, 1, &value), REFUSED);
}

Outcome try_GetInteger(Session *s) {
    const fmi2ValueReference reference = below(s, (unsigned)s->fmu->variables);
    fmi2Integer value;
    int found = 0;
    for (int i = 0; i < s->fmu->variables; i++) {
        found = found || (s->fmu->variable[i].kind == 'n' && s->fmu->variable[i].reference == reference);
    }
    const size_t count = mistake(s, 1) == 0 || found;
    return outcome(s->fmu->GetInteger(s->component, &reference, count, &value),
                   count == 0 || found ? calculation(s) : REFUSED);
}

/* No variable has these types, or none can be set. */
#define OTHER_TYPE(name, type)                                                                       \
    Outcome try_##name(Session *s) {                                                                 \
        const fmi2ValueReference reference = below(s, 3);                                            \
        type value;                                                                                  \
        memset(&value, 0, sizeof value);                                                             \
        const size_t count = mistake(s, 1) == 0;                                                     \
        return outcome(s->fmu->name(s->component, &reference, count, &value), count ? REFUSED : OK); \
    }
OTHER_TYPE(GetBoolean, fmi2Boolean)
OTHER_TYPE(GetString, fmi2String)
OTHER_TYPE(SetInteger, fmi2Integer)
OTHER_TYPE(SetBoolean, fmi2Boolean)
OTHER_TYPE(SetString, fmi2String)

/* An array over the continuous states, of just the size; sometimes of another one, or none. */
static Outcome over_states(Session *s, fmi2Status (*call)(fmi2Component, fmi2Real[], size_t), unsigned allowed) {
    const unsigned fault = mistake(s, 3);
    const size_t size = s->fmu->states + (fault == 0 ? 1 : 0) - (fault == 1 ? 1 : 0);
    double *values = malloc(size * sizeof *values);
    const fmi2Status status = call(s->component, fault == 2 ? NULL : values, size);
    free(values);
    return outcome(status, fault < 3 ? REFUSED : allowed);
}

/* A singular mass matrix may come near. */
Outcome try_GetDerivatives(Session *s) {
    return over_states(s, s->fmu->GetDerivatives, calculation(s) | (s->model.wild ? WARNED : 0));
}

Outcome try_GetContinuousStates(Session *s) { return over_states(s, s->fmu->GetContinuousStates, calculation(s)); }
Outcome try_GetNominalsOfContinuousStates(Session *s) {
    return over_states(s, s->fmu->GetNominalsOfContinuousStates, OK);
}

Outcome try_GetEventIndicators(Session *s) {
    double values[MAX_STATES];
    const size_t wrong = mistake(s, 1) == 0, count = s->fmu->indicators + wrong;
    const fmi2Status status = s->fmu->GetEventIndicators(s->component, values, count);
    return outcome(status, wrong ? REFUSED : s->fmu->indicators > 0 ? calculation(s) : OK);
}

Outcome try_SetContinuousStates(Session *s) {
    double *values = malloc(s->fmu->states * sizeof *values);
    const unsigned fault = mistake(s, 3);
    size_t count = 0;
    int wild = 0;
    for (int i = 0; i < s->fmu->variables && count < s->fmu->states; i++) {
        const Variable *v = &s->fmu->variable[i];
        if (v->kind == 'x' || v->kind == 'l') {
            values[count] = value_for(s, v);
            wild |= is_wild(s, v, values[count++]);
        }
    }
    expect(count == s->fmu->states, "the states are %u variables", (unsigned)count);
    if (fault == 0) {
        values[below(s, (unsigned)count)] = not_finite(s);
    }
    const fmi2Status status = s->fmu->SetContinuousStates(s->component, fault == 1 ? NULL : values,
                                                          count - (fault == 2 ? 1 : 0));
    free(values);
    s->model.wild |= status == fmi2OK && wild;
    return outcome(status, fault == 0 ? DISCARDED : fault < 3 ? REFUSED : OK);
}

/* --------------------------------------------------------------------------------------------------------
   derivatives */

Outcome try_GetDirectionalDerivative(Session *s) {
    const fmi2ValueReference none = NO_SUCH_REFERENCE;
    fmi2ValueReference unknowns[MANY], knowns[MANY];
    double seeds[MANY], values[MANY];
    const unsigned fault = mistake(s, 7);
    const size_t n_unknowns = below(s, MANY + 1), n_knowns = 1 + below(s, MANY);
    for (size_t i = 0; i < n_unknowns; i++) {
        unknowns[i] = pick(s, "xlydc")->reference;
    }
    for (size_t i = 0; i < n_knowns; i++) {
        knowns[i] = pick(s, "xlup")->reference;
        seeds[i] = between(s, -1.0, 1.0);
    }
    switch (fault) {
    case 0: knowns[below(s, (unsigned)n_knowns)] = none; break;
    case 1: knowns[0] = pick(s, "d")->reference; break; /* a velocity has two variables; ... */
    case 2: seeds[0] = not_finite(s); break;
    default: break;
    }
    const fmi2Status status = s->fmu->GetDirectionalDerivative(
        s->component, fault == 3 ? &none : fault == 4 ? NULL : unknowns, fault == 3 || fault == 4 ? 1 : n_unknowns,
        fault == 5 ? NULL : knowns, n_knowns, seeds, fault == 6 && n_unknowns > 0 ? NULL : values);
    const int refused = (fault < 6 && fault != 1) || (fault == 6 && n_unknowns > 0);
    /* ... so that a derivative can be a known, if it is that of a coordinate */
    return outcome(status, refused ? REFUSED : fault == 1 ? calculation(s) | REFUSED : calculation(s));
}

Outcome try_SetRealInputDerivatives(Session *s) {
    fmi2ValueReference reference = pick(s, "u")->reference;
    fmi2Integer order = (fmi2Integer)(1 + below(s, 3));
    double value = between(s, -1.0, 1.0);
    const unsigned fault = mistake(s, 7);
    switch (fault) {
    case 0: reference = NO_SUCH_REFERENCE; break;
    case 1: reference = pick(s, "xcdt")->reference; break;
    case 2: order = 0; break;
    case 3: order = 4; break;
    case 4: value = not_finite(s); break;
    default: break;
    }
    const fmi2Status status = s->fmu->SetRealInputDerivatives(s->component, &reference, 1, fault == 5 ? NULL : &order,
                                                              fault == 6 ? NULL : &value);
    return outcome(status, fault < 7 ? REFUSED : calculation(s));
}

Outcome try_GetRealOutputDerivatives(Session *s) {
    fmi2ValueReference reference = pick(s, "xy")->reference;
    fmi2Integer order = (fmi2Integer)(1 + below(s, 2));
    double value;
    const unsigned fault = mistake(s, 6);
    switch (fault) {
    case 0: reference = NO_SUCH_REFERENCE; break;
    case 1: reference = pick(s, "upft")->reference; break;
    case 2: order = 0; break;
    case 3: order = 3; break;
    default: break;
    }
    const fmi2Status status = s->fmu->GetRealOutputDerivatives(s->component, &reference, 1, fault == 4 ? NULL : &order,
                                                               fault == 5 ? NULL : &value);
    return outcome(status, fault < 6 ? REFUSED : calculation(s));
}
