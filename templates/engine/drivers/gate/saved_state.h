/* Saved states: copies of Session and State that the importer holds. Each function is the body of one of the standard,
   which is the call. */
#ifndef SAVED_STATE_H
#define SAVED_STATE_H

#include "gate.h"

Status get_state(void *handle, Call call, void **saved);
Status set_state(void *handle, Call call, void *saved);
Status free_state(void *handle, Call call, void **saved);
Status state_size(void *handle, Call call, void *saved, size_t *size);
Status serialize_state(void *handle, Call call, void *saved, void *bytes, size_t size);
Status deserialize_state(void *handle, Call call, const void *bytes, size_t size, void **saved);

#endif
