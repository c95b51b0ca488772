; when inside when inside forall, and the condition is judged before anything falls
(define (domain dominoes)
  (:requirements :adl)
  (:types stone)
  (:predicates (next ?a ?b - stone) (fallen ?s - stone) (glued ?s - stone) (wet))
  (:action push
    :parameters (?s - stone)
    :precondition (not (fallen ?s))
    :effect (and (when (not (glued ?s))
                   (and (fallen ?s)
                        (forall (?n - stone)
                          (when (next ?s ?n)
                            (when (or (not (glued ?n)) (wet)) (fallen ?n))))))))
  (:action water
    :parameters ()
    :effect (and (wet)))
  (:action dry
    :precondition (wet)
    :effect (forall (?s - stone) (and (not (glued ?s)) (not (wet))))))
