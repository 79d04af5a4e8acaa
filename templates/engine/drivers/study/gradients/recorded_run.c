/* Runs on a tape, and the way back. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "inputs.h"
#include "tape.h"

/* A tape for runs of a study that has room for the directions of what jumps behind those that are varied; NULL without
   memory. The tape ends before the study. */
STUDY_EXPORT void *study_tape_new(void *study, int varied);
STUDY_EXPORT void study_tape_free(void *tape);

/* How many directions behind those that are varied a study needs for a tape. */
STUDY_EXPORT int study_tape_room(void);

/* From now on a run is given up whose steps, events and samples are more than this; 0: none is. Returns how many the
   last run had. */
STUDY_EXPORT size_t study_tape_limit(void *tape, size_t most);

/* As study_run, after the directions were seeded, but with values only. */
STUDY_EXPORT int study_record(void *tape, const Request *request);

/* gradient[varied], the derivatives along the directions of what has the derivatives weights[n_times, n_outputs] by the
   samples of the recorded run. Returns 0, with a message of the study, if that fails. */
STUDY_EXPORT int study_gradient(void *tape, const Request *request, const double weights[], double gradient[]);

int study_tape_room(void) {
    return N_EVENTS > 0 ? N_JUMPING : 0;
}

void *study_tape_new(void *study, int varied) {
    Tape *tape = (Tape *)calloc(1, sizeof(Tape));
    if (tape == NULL) {
        return NULL;
    }
    tape->variations = study;
    tape->varied = varied;
    tape->entries.size = sizeof(Entry);
    tape->checkpoints.size = sizeof(Checkpoint);
    tape->kept.size = sizeof(Kept);
    tape->jacobians.size = N_JUMPING * (size_t)(varied + N_JUMPING) * sizeof(double);
    tape->seeds = (Seed *)calloc((size_t)varied, sizeof(Seed));
    tape->starts = (double *)calloc((size_t)varied * N_JUMPING, sizeof(double));
    tape_begin_method(tape);
    if (tape->seeds == NULL || tape->starts == NULL) {
        study_tape_free(tape);
        return NULL;
    }
    return tape;
}

void study_tape_free(void *handle) {
    Tape *tape = handle;
    if (tape != NULL) {
        free(tape->entries.data);
        free(tape->checkpoints.data);
        free(tape->kept.data);
        free(tape->jacobians.data);
        free(tape->seeds);
        free(tape->starts);
        free(tape);
    }
}

void *tape_add(Tape *tape, List *list) {
    if (list->count == list->room) {
        const size_t room = 2 * list->room + 16;
        void *data = realloc(list->data, room * list->size);
        if (data == NULL) {
            tape->no_memory = true;
            return NULL;
        }
        list->data = data;
        list->room = room;
    }
    return list_at(list, list->count++);
}

/* ------------------------------------------------------------------------------------------------------ recording */

size_t study_tape_limit(void *handle, size_t most) {
    Tape *tape = handle;
    tape->most = most;
    return tape->entries.count;
}

static Entry *add_entry(Tape *tape, EntryKind kind) {
    Study *study = &tape->variations->study;
    if (tape->most > 0 && tape->entries.count >= tape->most) {
        snprintf(study->message, sizeof study->message, "it takes more than %.0f steps", (double)tape->most);
        return NULL;
    }
    Entry *entry = tape_add(tape, &tape->entries);
    if (entry != NULL) {
        memset(entry, 0, sizeof *entry);
        entry->kind = kind;
        entry->time = study->instance.state.time;
        entry->first = entry->end = tape->variations->next;
        entry->base = tape->kept.count - 1;
    }
    return entry;
}

/* An entry with the present point as its checkpoint, and the result of the trial step as its end. */
static Entry *add_checked(Tape *tape, EntryKind kind) {
    const Instance *instance = &tape->variations->study.instance;
    Entry *entry = add_entry(tape, kind);
    Checkpoint *checkpoint = entry != NULL ? tape_add(tape, &tape->checkpoints) : NULL;
    if (checkpoint == NULL) {
        return NULL;
    }
    entry->place = tape->checkpoints.count - 1;
    memcpy(checkpoint->states, instance->state.states, sizeof checkpoint->states);
    memcpy(checkpoint->slope, instance->state.first_stage, sizeof checkpoint->slope);
    memcpy(checkpoint->unprojected, instance->scratch.unprojected, sizeof checkpoint->unprojected);
    memcpy(checkpoint->end_states, instance->scratch.new_states, sizeof checkpoint->end_states);
    step_record_take(&checkpoint->record, instance);
    return entry;
}

/* Keeps what holds from here on. */
static bool keep(Tape *tape) {
    const Instance *instance = &tape->variations->study.instance;
    Kept *kept = tape_add(tape, &tape->kept);
    if (kept == NULL) {
        return false;
    }
    kept->state = instance->state;
    kept->state.event_held = 1; /* modes do not follow what is set on the way back */
    kept->inputs_move = instance->scratch.inputs_move;
    kept->step_start = instance->scratch.step_start;
    return true;
}

/* Does a contact slide in another direction than that which is kept? It turns between steps, see contacts_turn. */
static bool turned(const Tape *tape) {
    const Kept *kept = list_at(&tape->kept, tape->kept.count - 1);
    const State *state = &tape->variations->study.instance.state;
    return memcmp(kept->state.parameters, state->parameters, sizeof state->parameters) != 0;
}

/* An entry from whose end on other inputs or modes hold. */
static Entry *add_kept(Tape *tape, EntryKind kind) {
    Entry *entry = add_entry(tape, kind);
    if (entry == NULL || !keep(tape)) {
        return NULL;
    }
    entry->base = tape->kept.count - 1;
    return entry;
}

/* The samples up to a time (s) within the step that is about to be accepted. */
static bool record_samples(Tape *tape, Step step) {
    Variations *variations = tape->variations;
    Instance *instance = &variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    const Request *request = tape->request;
    if (variations->next >= request->n_times || !(request->times[variations->next] < step.end)) {
        return arena_leave(mark, true);
    }
    if (!dense_begin(instance, step)) {
        return arena_leave(mark, false);
    }
    for (; variations->next < request->n_times && request->times[variations->next] < step.end; variations->next++) {
        dense_states(&instance->state.dense, request->times[variations->next], states);
        if (!directions_sample(variations, request->times[variations->next], states)) {
            return arena_leave(mark, false);
        }
    }
    return arena_leave(mark, true);
}

static bool follow_nothing(void *of, Step step, double *error) {
    (void)of;
    (void)step;
    *error = 0.0;
    return true;
}

static bool finish_nothing(void *of, Step tried, Step step) {
    (void)of;
    (void)tried;
    (void)step;
    return true;
}

static bool record_step(void *of, Step step) {
    Tape *tape = of;
    if (!(step.length > 0.0)) {
        return true;
    }
    if (turned(tape) && !keep(tape)) {
        return false;
    }
    Entry *entry = add_checked(tape, ENTRY_STEP);
    if (entry == NULL) {
        return false;
    }
    entry->step = step;
    if (!record_samples(tape, step)) {
        return false;
    }
    entry->end = tape->variations->next;
    return true;
}

/* Does a latch hold a place there, which may vary? Other modes are 0 or 1. */
static bool holds_place(double value) {
    return value != 0.0 && value != 1.0;
}

/* Directions along what is varied, and along all that jumps. */
static void vary_all(Tape *tape) {
    Variations *variations = tape->variations;
    const State *state = &variations->study.instance.state;
    variations->count = tape->varied + N_JUMPING;
    for (int d = 0; d < N_JUMPING; d++) {
        Direction *direction = &variations->directions[tape->varied + d];
        memset(&direction->seed, 0, sizeof direction->seed);
        if (d < N_STATES) {
            direction->scale = NOMINAL_STATES[d];
            direction->seed.states[d] = 1.0;
        } else {
            const double value = state->parameters[d - N_STATES];
            direction->scale = 1.0 + fabs(value);
            direction->seed.parameters[d - N_STATES] = holds_place(value) ? 1.0 : 0.0;
        }
    }
    for (int d = 0; d < tape->varied; d++) {
        variations->directions[d].seed = tape->seeds[d];
        memset(variations->directions[d].seed.states, 0, sizeof tape->seeds[d].states);
    }
}

/* results[N_JUMPING] of a direction. */
static void read_jumped(const Direction *direction, double results[]) {
    memcpy(results, direction->states, N_STATES * sizeof(double));
    memcpy(results + N_STATES, direction->seed.parameters, N_MASKS * sizeof(double));
}

static bool record_event(void *of) {
    Tape *tape = of;
    Variations *variations = tape->variations;
    const State *state = &variations->study.instance.state;
    vary_all(tape);
    bool passed = directions_project(variations, state->time, state->states, state->states);
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->states, direction->seed.states, sizeof direction->states);
    }
    passed = passed && directions_pass(variations);
    double *jacobian = passed ? tape_add(tape, &tape->jacobians) : NULL;
    for (int d = 0; d < variations->count && jacobian != NULL; d++) {
        read_jumped(&variations->directions[d], jacobian + (size_t)d * N_JUMPING);
    }
    variations->count = 0;
    Entry *entry = jacobian != NULL ? add_kept(tape, ENTRY_EVENT) : NULL;
    if (entry == NULL) {
        return false;
    }
    entry->place = tape->jacobians.count - 1;
    return true;
}

static bool record_stretch(Variations *variations, double end) {
    Tape *tape = variations->tape;
    const Companion recorder = {tape, follow_nothing, finish_nothing, record_step, record_event};
    return directions_begin_stretch(variations, end, &recorder) && add_kept(tape, ENTRY_STRETCH) != NULL &&
           directions_step(variations, end, &recorder);
}

/* Samples at the end of a stretch. */
static bool record_end(Variations *variations) {
    const State *state = &variations->study.instance.state;
    const Request *request = variations->request;
    if (variations->next >= request->n_times || request->times[variations->next] > state->time) {
        return true;
    }
    Entry *entry = add_checked(variations->tape, ENTRY_SAMPLES);
    if (entry == NULL) {
        return false;
    }
    while (variations->next < request->n_times && request->times[variations->next] <= state->time) {
        if (!directions_sample(variations, state->time, state->states)) {
            return false;
        }
        variations->next++;
    }
    entry->end = variations->next;
    return true;
}

/* How the start answers to what is varied. */
static bool record_start(Tape *tape) {
    Variations *variations = tape->variations;
    variations->count = tape->varied;
    if (!directions_begin(variations)) {
        return false;
    }
    for (int d = 0; d < tape->varied; d++) {
        Seed *seed = &tape->seeds[d];
        read_jumped(&variations->directions[d], tape->starts + (size_t)d * N_JUMPING);
        *seed = variations->directions[d].seed;
        memset(seed->states, 0, sizeof seed->states);
        memset(seed->parameters, 0, N_MASKS * sizeof(double));
    }
    variations->count = 0;
    return true;
}

/* Why the tape or the run ended early. */
static bool explain_tape(Tape *tape) {
    Study *study = &tape->variations->study;
    if (study->message[0] == '\0' && !tape->no_memory) {
        study_explain(study);
    } else if (study->message[0] == '\0') {
        snprintf(study->message, sizeof study->message, "there is no memory for its steps");
    }
    return false;
}

int study_record(void *handle, const Request *request) {
    Tape *tape = handle;
    Variations *variations = tape->variations;
    tape->entries.count = tape->checkpoints.count = tape->kept.count = tape->jacobians.count = 0;
    tape->request = variations->request = request;
    variations->tape = tape;
    variations->next = 0;
    if (!record_start(tape) || !study_stretches(variations, record_stretch, record_end)) {
        explain_tape(tape);
    }
    variations->count = tape->varied + study_tape_room(); /* those of the study, as before */
    return variations->next;
}

/* --------------------------------------------------------------------------------------------------- the way back */

/* The inputs and modes that held there. */
static void restore(Tape *tape, size_t base) {
    Variations *variations = tape->variations;
    Instance *instance = &variations->study.instance;
    const Kept *kept = list_at(&tape->kept, base);
    instance->state = kept->state;
    instance->scratch.inputs_move = kept->inputs_move;
    instance->scratch.step_start = kept->step_start;
    instance_forget_cache(instance);
    variations->probe.state = kept->state;
    variations->probe.scratch.inputs_move = false;
    instance_forget_cache(&variations->probe);
    tape->base = base;
}

static double product(const double a[], const double b[], int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* What has the derivatives total by what jumped, along a row of the Jacobian of the jump. */
static double along(const Seed *total, const double jumped[]) {
    return product(total->states, jumped, N_STATES) + product(total->parameters, jumped + N_STATES, N_MASKS);
}

static void event_back(Tape *tape, const double jacobian[]) {
    const ArenaMark mark = arena_mark(tape->variations->study.instance.arena);
    WORK(mark, double, before, N_JUMPING);
    for (int d = 0; d < tape->varied; d++) {
        tape->gradient[d] += along(&tape->total, jacobian + (size_t)d * N_JUMPING);
    }
    for (int d = 0; d < N_JUMPING; d++) {
        before[d] = along(&tape->total, jacobian + (size_t)(tape->varied + d) * N_JUMPING);
    }
    memcpy(tape->total.states, before, N_STATES * sizeof(double));
    memcpy(tape->total.parameters, before + N_STATES, N_MASKS * sizeof(double));
    arena_release(mark);
}

static bool samples_at_end_back(Tape *tape, const Entry *entry) {
    const Checkpoint *checkpoint = list_at(&tape->checkpoints, entry->place);
    for (int k = entry->first; k < entry->end; k++) {
        if (!tape_sample_back(tape, k, entry->time, checkpoint->states, tape->total.states)) {
            return false;
        }
    }
    return true;
}

static bool entry_back(Tape *tape, const Entry *entry) {
    const Kept *kept = list_at(&tape->kept, entry->base);
    if (entry->base != tape->base) {
        restore(tape, entry->base);
    }
    switch (entry->kind) {
    case ENTRY_STRETCH:
        return tape_project_back(tape, entry->time, kept->state.states, kept->state.states, tape->total.states);
    case ENTRY_STEP:    return tape_step_back(tape, entry, list_at(&tape->checkpoints, entry->place));
    case ENTRY_SAMPLES: return samples_at_end_back(tape, entry);
    case ENTRY_EVENT:   event_back(tape, list_at(&tape->jacobians, entry->place)); break;
    }
    return true;
}

int study_gradient(void *handle, const Request *request, const double weights[], double gradient[]) {
    Tape *tape = handle;
    tape->request = tape->variations->request = request;
    tape->weights = weights;
    tape->gradient = gradient;
    memset(&tape->total, 0, sizeof tape->total);
    memset(gradient, 0, (size_t)tape->varied * sizeof(double));
    restore(tape, tape->kept.count - 1);
    for (size_t i = tape->entries.count; i-- > 0;) {
        if (!entry_back(tape, list_at(&tape->entries, i))) {
            return explain_tape(tape);
        }
    }
    for (int d = 0; d < tape->varied; d++) {
        gradient[d] += along(&tape->total, tape->starts + (size_t)d * N_JUMPING) +
                       product(tape->total.inputs, tape->seeds[d].inputs, N_SIGNALS) +
                       product(tape->total.parameters, tape->seeds[d].parameters, SIZE_PARAMETERS);
    }
    return 1;
}
