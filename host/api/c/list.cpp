#include <cstddef>

#include "api/c/handles.h"
#include "clarus/clarus.h"

extern "C" {

size_t clarus_list_count(const clarus_list* list) { return list ? list->words.size() : 0; }

const char* clarus_list_item(const clarus_list* list, size_t index) {
    return index < clarus_list_count(list) ? list->words[index].c_str() : nullptr;
}

void clarus_list_release(clarus_list* list) { delete list; }

}  // extern "C"
