/* Keeping what the importer should know. */
#include "notices.h"

void begin_notices(Instance *instance) {
    instance->n_notices = 0;
}

void add_notice(Instance *instance, NoticeKind kind, double step, int index) {
    if (instance->n_notices < MOST_NOTICES) {
        instance->notices[instance->n_notices++] = (Notice){kind, instance->state.time, step, index};
    }
}

void give_notice(Instance *instance, NoticeKind kind, double step, int index) {
    if ((instance->state.noticed & (int64_t)kind) == 0) {
        instance->state.noticed |= (int64_t)kind;
        add_notice(instance, kind, step, index);
    }
}
