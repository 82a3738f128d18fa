/* A driver whose queue families have no graphics, like those that GPUs offer for computing beside a renderer. Apart
 * from that it is libvulkan_lvp.so, which is loaded with it. It lies below the validation layers, which therefore
 * object to everything that needs graphics: commands, stages of barriers, stages of timestamps. */
#include <dlfcn.h>
#include <stdint.h>
#include <string.h>

typedef struct { uint32_t flags, count, timestamp_bits, granularity[3]; } family;
typedef struct { uint32_t type; void *next; family family; } family2;
typedef void (*function)(void);
typedef void (*list)(void *device, uint32_t *count, family *out);
typedef void (*list2)(void *device, uint32_t *count, family2 *out);
enum { GRAPHICS = 1 };

static list families;
static list2 families2;

static void without_graphics(void *device, uint32_t *count, family *out) {
    families(device, count, out);
    for (uint32_t i = 0; out && i < *count; ++i) out[i].flags &= ~(uint32_t)GRAPHICS;
}

static void without_graphics2(void *device, uint32_t *count, family2 *out) {
    families2(device, count, out);
    for (uint32_t i = 0; out && i < *count; ++i) out[i].family.flags &= ~(uint32_t)GRAPHICS;
}

function vk_icdGetInstanceProcAddr(void *instance, const char *name) {
    void *driver = dlopen("libvulkan_lvp.so", RTLD_NOW | RTLD_NOLOAD);
    function (*look_up)(void *, const char *) = (function (*)(void *, const char *))dlsym(driver, "vk_icdGetInstanceProcAddr");
    function found = look_up(instance, name);
    if (!found) return found;
    if (!strcmp(name, "vkGetPhysicalDeviceQueueFamilyProperties")) return families = (list)found, (function)without_graphics;
    if (!strncmp(name, "vkGetPhysicalDeviceQueueFamilyProperties2", 41)) return families2 = (list2)found, (function)without_graphics2;
    return found;
}
