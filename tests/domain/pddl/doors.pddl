; a door opens with its key, a crowbar, or when it is not locked: or, imply
(define (domain doors)
  (:requirements :strips :typing :disjunctive-preconditions :negative-preconditions)
  (:types door item room)
  (:constants crowbar - item)
  (:predicates (has ?i - item) (fits ?i - item ?d - door) (locked ?d - door) (open ?d - door)
               (joins ?d - door ?a ?b - room) (in ?r - room) (lies ?i - item ?r - room) (alarm))
  (:action take
    :parameters (?i - item ?r - room)
    :precondition (and (in ?r) (lies ?i ?r))
    :effect (and (has ?i) (not (lies ?i ?r))))
  (:action open-with
    :parameters (?d - door ?i - item)
    :precondition (and (not (open ?d)) (has ?i)
                       (or (fits ?i ?d) (and (= ?i crowbar) (not (alarm))) (not (locked ?d))))
    :effect (and (open ?d) (not (locked ?d))))
  (:action pass
    :parameters (?d - door ?a ?b - room)
    :precondition (and (in ?a) (or (joins ?d ?a ?b) (joins ?d ?b ?a))
                       (imply (locked ?d) (alarm)) (open ?d))
    :effect (and (in ?b) (not (in ?a)))))
